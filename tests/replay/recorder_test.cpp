// Contents of a recording: positions, rewards by term, actions, events, chains, lights and images.
#include "pictura/replay/recorder.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/replay/images.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::message_of;
using testing::HasSubstr;

std::unique_ptr<Simulator> town(int agents, float reset_inactive_fraction = 0.4f) {
  SimulatorConfig config;
  config.seed = 5;
  config.parked_cars = 4;
  config.episode_steps = 150;
  config.reset_inactive_fraction = reset_inactive_fraction;
  // The second of two worlds is recorded: its agents, boxes and lights do not begin at 0.
  return make_simulator("cpu", config, {load_map("procedural:1:blocks=2x2")}, {{0, 7, 0}, {0, agents, 1}});
}

constexpr int kWorld = 1, kFirstSlot = 7, kAgents = 30;

/// Drives and records; calls visit(frame, result) at each frame, the first with none.
template <typename Visit>
Replay record(Simulator& simulator, const std::string& policy, int steps, const RecorderOptions& options, Visit&& visit,
              std::vector<int32_t>* agent_of_out = nullptr) {
  const std::unique_ptr<Controller> controller = make_controller(policy, simulator, 9);
  Recorder recorder(simulator, options);
  std::vector<Command> commands(static_cast<size_t>(simulator.num_slots()));
  visit(0, nullptr, commands);
  for (int step = 0; step < steps; ++step) {
    controller->act(simulator.arrays(), {}, commands);
    ReplayDecision decision;
    decision.probabilities[3] = 0.25f;
    decision.value = -0.5f * static_cast<float>(step);
    recorder.decide(decision);
    recorder.before_step(commands);
    const StepResult result = simulator.step(Span<const Command>(commands));
    recorder.after_step(result);
    visit(step + 1, &result, commands);
  }
  return recorder.finish({.policy = policy}, agent_of_out);
}

constexpr int kStreetAgents = 6;

/// A street that vehicles leave and enter, as the only world.
std::unique_ptr<Simulator> street() {
  SimulatorConfig config;
  config.num_threads = 1;
  config.parked_cars = 0;
  config.pedestrian_fraction = config.cyclist_fraction = 0;
  const auto map = std::make_shared<RoadMap>(parse_opendrive(test::open_street(120), "street.xodr"));
  return make_simulator("cpu", config, {map}, {{0, kStreetAgents, 0}});
}

TEST(Recorder, RecordsEachLifeAsAnAgent) {
  const auto simulator = street();
  const Replay replay = record(*simulator, "idm_lanes", 300, {}, [](auto&&...) {});
  const SpawnReport report = simulator->spawn_report();
  ASSERT_GT(report.entered, 4);
  ASSERT_EQ(replay.num_agents, 6 + report.entered);
  const ReplayEpisode& episode = replay.episodes.front();
  ASSERT_EQ(episode.agents.size(), static_cast<size_t>(replay.num_agents));
  for (int agent = 0; agent < replay.num_agents; ++agent) {
    int first = -1, last = -1, there = 0;
    for (int frame = 0; frame < replay.num_frames; ++frame) {
      if (replay.at(Track::status, frame, agent) == static_cast<int32_t>(AgentStatus::absent)) continue;
      if (first < 0) first = frame;
      EXPECT_TRUE(last < 0 || last == frame - 1) << agent << ": without gaps";
      last = frame;
      ++there;
    }
    if (agent < 6 && there == 0) continue;  // agents without a place
    EXPECT_GT(there, 0) << agent;
    EXPECT_GE(episode.agents[agent].length_cm, 350);
    const bool has_chain = std::any_of(episode.chains.begin(), episode.chains.end(), [&](const ReplayChain& chain) {
      return chain.agent == agent && chain.frame == first;
    });
    EXPECT_TRUE(has_chain) << agent;
  }
}

TEST(Recorder, ContinuesAnEpisodeWithTheLivesOfItsAgents) {
  const auto simulator = street();
  const auto nothing = [](auto&&...) {};
  record(*simulator, "idm_lanes", 200, {}, nothing);
  const int64_t entered = simulator->spawn_report().entered;
  ASSERT_GT(entered, 0);
  const Replay replay = record(*simulator, "idm_lanes", 1, {}, nothing);
  EXPECT_EQ(replay.num_agents, kStreetAgents + simulator->spawn_report().entered - entered);
}

TEST(Recorder, FollowsTheAgentsOfASlot) {
  const auto simulator = street();
  std::vector<int32_t> x_cm;  // position of the slot's agent; 0 without one
  std::vector<int32_t> agent_of;
  const Replay replay = record(
      *simulator, "idm_lanes", 300, {.followed = 0},
      [&](auto&&...) {
        const bool is_there = has_body(simulator->state().status[0]);
        x_cm.push_back(is_there ? replay_box(simulator->scene().agents[0]).x_cm : 0);
      },
      &agent_of);
  ASSERT_EQ(replay.followed, 0);
  ASSERT_EQ(replay.followed_agents.size(), 301u);
  EXPECT_EQ(replay.followed_agents.front(), 0);
  EXPECT_GE(replay.followed_agents.back(), kStreetAgents);
  for (int frame = 0; frame < replay.num_frames; ++frame) {
    const int32_t agent = replay.followed_at(frame);
    ASSERT_EQ(replay.at(Track::x_m, frame, agent), x_cm[frame]) << frame;
    ASSERT_EQ(agent_of[frame * kStreetAgents], agent);
  }
}

TEST(Recorder, EndsBeforeItsAgentsAreTooManyForItsSteps) {
  const auto simulator = street();
  constexpr int64_t kMax = 200 * 10 * int64_t{kNumTracks};
  const Replay replay = record(*simulator, "idm_lanes", 300, {.max_numbers = kMax}, [](auto&&...) {});
  const int64_t numbers = int64_t{replay.num_frames} * replay.num_agents * int64_t{kNumTracks};
  EXPECT_LE(numbers, kMax);
  EXPECT_GT(numbers, kMax / 2);
  EXPECT_GT(replay.num_agents, kStreetAgents);
  EXPECT_LT(replay.num_frames, 301);
  EXPECT_EQ(replay.tracks[0].size(), static_cast<size_t>(replay.num_frames) * static_cast<size_t>(replay.num_agents));
}

TEST(Recorder, DiscardingKeepsTheBodiesOfAgentsThatEntered) {
  const auto simulator = street();
  const auto controller = make_controller("idm_lanes", *simulator, 9);
  Recorder recorder(*simulator, {});
  std::vector<Command> commands(kStreetAgents);
  size_t entered = 0;
  for (int step = 0; step < 200; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    recorder.before_step(commands);
    recorder.after_step(simulator->step(Span<const Command>(commands)));
    entered += recorder.discard_history().size();
    const ReplayEpisode& episode = recorder.recorded().episodes.back();
    for (int agent = 0; agent < kStreetAgents; ++agent) {
      if (!has_body(simulator->state().status[agent])) continue;
      ASSERT_EQ(episode.agents[agent], replay_box(simulator->scene().agents[agent]).body) << agent;
      ASSERT_EQ(episode.conditioning[agent * kNumConditioning],
                simulator->state().conditioning[agent * kNumConditioning]);
    }
  }
  EXPECT_EQ(static_cast<int64_t>(entered), simulator->spawn_report().entered);
  EXPECT_GT(entered, 0u);
  EXPECT_EQ(recorder.finish({}).num_agents, kStreetAgents);
}

TEST(Recorder, SceneryIsTheMapsGeometryToACentimetre) {
  const std::unique_ptr<Simulator> simulator = town(kAgents);
  const StaticGeometry& geometry = simulator->maps()[0]->geometry;
  const ReplayScenery scenery = record(*simulator, "idle", 1, {.world = kWorld}, [](auto&&...) {}).scenery;
  const auto near = [](const ReplayPoint& point, const Vec3& place) {
    return std::abs(0.01f * static_cast<float>(point[0]) - place.x) < 0.0051f &&
           std::abs(0.01f * static_cast<float>(point[1]) - place.y) < 0.0051f &&
           std::abs(0.01f * static_cast<float>(point[2]) - place.z) < 0.0051f;
  };
  size_t strip = 0;
  for (const ReplayLine& line : scenery.lines) {
    for (size_t i = 0; i + 1 < line.points_cm.size(); ++i, ++strip) {
      const Strip& drawn = geometry.strips.at(strip);
      ASSERT_TRUE(near(line.points_cm[i], drawn.a_m) && near(line.points_cm[i + 1], drawn.b_m)) << strip;
      EXPECT_EQ(line.kind, drawn.kind);
      EXPECT_NEAR(0.001f * static_cast<float>(line.width_mm), drawn.width_m, 0.0006f);
    }
  }
  EXPECT_EQ(strip, geometry.strips.size());
  EXPECT_LT(scenery.lines.size(), geometry.strips.size() / 2);
  ASSERT_EQ(scenery.walls.size(), geometry.walls.size());
  ASSERT_GT(scenery.walls.size(), 0u);
  EXPECT_TRUE(near(scenery.walls[0].a_cm, geometry.walls[0].a_m));
  ASSERT_EQ(scenery.heads.size(), geometry.heads.size());
  ASSERT_GT(scenery.heads.size(), 0u);
  EXPECT_TRUE(near(scenery.heads[0].position_cm, geometry.heads[0].position_m));
}

TEST(Recorder, TheOriginHoldsTheLightCycles) {
  const auto recorded = [](const SimulatorConfig& config, const std::string& map) {
    const auto simulator = make_simulator("cpu", config, {load_map(map)}, {{0, 2, 0}});
    return record(*simulator, "idle", 1, {}, [](auto&&...) {}).origin.light_cycles;
  };
  EXPECT_EQ(recorded({}, "procedural:1:blocks=2x2"), "phases");
  EXPECT_EQ(recorded({.light_cycles = LightCycles::independent}, "procedural:1:blocks=2x2"), "independent");
}

TEST(Recorder, PositionsAreWithinHalfAUnitOfTheSimulators) {
  for (const char* policy : {"random", "lane"}) {
    const std::unique_ptr<Simulator> simulator = town(kAgents);
    std::vector<std::vector<AgentBox>> boxes;
    std::vector<std::vector<float>> speeds;
    const Replay replay =
        record(*simulator, policy, 200, {.world = kWorld}, [&](int, const StepResult*, const std::vector<Command>&) {
          const SceneBatch& scene = simulator->scene();
          const auto first = static_cast<size_t>(scene.world_begin[kWorld]);
          boxes.emplace_back(scene.agents.begin() + first, scene.agents.begin() + first + kAgents);
          speeds.emplace_back(simulator->state().speed_mps + kFirstSlot,
                              simulator->state().speed_mps + kFirstSlot + kAgents);
        });
    ASSERT_EQ(replay.num_frames, 201);
    ASSERT_EQ(replay.num_agents, kAgents);
    EXPECT_GE(replay.episodes.size(), 2u);  // their first frames are resets
    int drawn = 0;
    for (int frame = 0; frame < replay.num_frames; ++frame) {
      for (int agent = 0; agent < kAgents; ++agent) {
        const AgentBox& box = boxes[frame][agent];
        const bool absent = replay.at(Track::status, frame, agent) == static_cast<int32_t>(AgentStatus::absent);
        ASSERT_EQ(absent, !box.drawn);
        if (absent) continue;
        ++drawn;
        const auto value = [&](Track track) {
          return replay.at(track, frame, agent) * kTracks[static_cast<size_t>(track)].unit;
        };
        EXPECT_NEAR(value(Track::x_m), static_cast<double>(box.center_m.x), 0.00501);
        EXPECT_NEAR(value(Track::y_m), static_cast<double>(box.center_m.y), 0.00501);
        EXPECT_NEAR(value(Track::z_m), static_cast<double>(box.center_m.z), 0.00501);
        EXPECT_NEAR(value(Track::speed_mps), static_cast<double>(speeds[frame][agent]), 0.00501);
        const double heading = value(Track::heading_deg) * static_cast<double>(kPi) / 180;
        EXPECT_NEAR(std::cos(heading), static_cast<double>(box.cos_heading), 0.0009);
        EXPECT_NEAR(std::sin(heading), static_cast<double>(box.sin_heading), 0.0009);
      }
    }
    EXPECT_GT(drawn, 4000);
  }
}

TEST(Recorder, RewardTermsAddUpToTheSimulatorsRewardAndMetricsToItsTotals) {
  for (const char* policy : {"random", "lane"}) {
    const std::unique_ptr<Simulator> simulator = town(kAgents, /*never*/ 2.0f);
    std::vector<std::vector<float>> rewards;
    int infractions = 0;
    const Replay replay = record(*simulator, policy, 140, {.world = kWorld},
                                 [&](int, const StepResult* result, const std::vector<Command>&) {
                                   std::vector<float> of_frame(kAgents);
                                   for (size_t i = 0; result && i < kAgents; ++i) {
                                     of_frame[i] = result->reward[kFirstSlot + i];
                                     infractions += result->terminated[kFirstSlot + i];
                                   }
                                   rewards.push_back(of_frame);
                                 });
    for (int frame = 0; frame < replay.num_frames; ++frame) {
      for (int agent = 0; agent < kAgents; ++agent) {
        double sum = 0;
#define X(name) sum += replay.at(Track::reward_##name, frame, agent) * kRewardUnit;
        PICTURA_REWARD_TERMS(X)
#undef X
        // Eleven roundings of half a unit, and that of float.
        EXPECT_NEAR(sum, static_cast<double>(rewards[frame][agent]), 9e-7);
      }
    }
    // The rewards of infractions are the terms of the motion before the halt.
    EXPECT_GE(infractions, std::string(policy) == "random" ? 10 : 0);
    const SimulatorTotals& totals = simulator->arrays().world_totals[kWorld];
    const ReplayMoment first = replay.first_infraction;
    EXPECT_EQ(first.frame > 0, infractions > 0);
    if (first.frame > 0) {
      EXPECT_NE(replay.at(Track::events, first.frame, first.agent) & kInfractions, 0);
      EXPECT_EQ(replay.at(Track::status, first.frame - 1, first.agent), static_cast<int32_t>(AgentStatus::active));
    }
    EXPECT_EQ(replay.metrics.agent_steps, totals.agent_steps);
    EXPECT_EQ(replay.metrics.collisions, totals.collisions);
    EXPECT_EQ(replay.metrics.at_fault_collisions, totals.at_fault_collisions);
    EXPECT_EQ(replay.metrics.off_road, totals.off_road);
    EXPECT_EQ(replay.metrics.red_light, totals.red_light);
    EXPECT_EQ(replay.metrics.wall_contacts, totals.wall_contacts);
    EXPECT_EQ(replay.metrics.goals_reached, totals.goals_reached);
    EXPECT_EQ(replay.metrics.waypoints_reached, totals.waypoints_reached);
    EXPECT_NEAR(replay.metrics.reward, totals.reward, 1e-3);
  }
}

TEST(Recorder, StepsBelongToTheirResultingFrame) {
  const std::unique_ptr<Simulator> simulator = town(kAgents);
  std::vector<std::vector<int32_t>> actions, events;
  const Replay replay = record(*simulator, "random", 120, {.world = kWorld, .followed = 2},
                               [&](int, const StepResult* result, const std::vector<Command>& commands) {
                                 std::vector<int32_t> of_frame(kAgents), events_of_frame(kAgents);
                                 for (size_t i = 0; result && i < kAgents; ++i) {
                                   if (result->valid[kFirstSlot + i]) of_frame[i] = 1 + commands[kFirstSlot + i].action;
                                   if (result->valid[kFirstSlot + i]) {
                                     events_of_frame[i] = simulator->state().events[kFirstSlot + i];
                                   }
                                 }
                                 actions.push_back(of_frame);
                                 events.push_back(events_of_frame);
                               });
  for (int frame = 0; frame < replay.num_frames; ++frame) {
    for (int agent = 0; agent < kAgents; ++agent) {
      EXPECT_EQ(replay.at(Track::action, frame, agent), actions[frame][agent]);
      EXPECT_EQ(replay.at(Track::events, frame, agent), events[frame][agent]);
    }
  }
  // Decisions belong to the frame in which they were made; the last frame has none.
  ASSERT_EQ(replay.decisions.size(), 121 * kDecisionValues);
  EXPECT_EQ(replay.decisions[10 * kDecisionValues + 3], 2500);
  EXPECT_EQ(replay.decisions[10 * kDecisionValues + kNumActions], -50000);
  EXPECT_EQ(replay.decisions[120 * kDecisionValues + 3], 0);
  // Each agent of each episode has a chain from its first frame on.
  for (const ReplayEpisode& episode : replay.episodes) {
    std::vector<int> first(kAgents);
    for (const ReplayChain& chain : episode.chains) {
      first[chain.agent] += chain.frame == episode.first_frame;
      EXPECT_GE(chain.frame, episode.first_frame);
      EXPECT_LT(chain.frame, episode.first_frame + episode.num_frames);
    }
    for (int agent = 0; agent < kAgents; ++agent) {
      const bool absent =
          replay.at(Track::status, episode.first_frame, agent) == static_cast<int32_t>(AgentStatus::absent);
      EXPECT_EQ(first[agent], absent ? 0 : 1);
    }
  }
}

TEST(Recorder, ImagesEqualTheOraclesBytes) {
  const std::unique_ptr<Simulator> simulator = town(kAgents);
  const RendererConfig config{.rig = paper_rig(32, 18)};
  const std::unique_ptr<Renderer> renderer = make_renderer("cpu", config);
  upload_maps(*simulator, renderer.get());
  HostImages images(config.rig, 1);
  constexpr int kFollowed = 3, kSteps = kReplayFramesPerGroup + 10;
  std::vector<std::string> frames;
  const Replay replay = record(
      *simulator, "lane", kSteps, {.world = kWorld, .followed = kFollowed, .cameras = config, .keeps_images = true},
      [&](int, const StepResult*, const std::vector<Command>&) {
        renderer->render(simulator->scene(), simulator->views().subspan(kFirstSlot + kFollowed, 1), images.batch());
        std::string frame;
        for (int camera = 0; camera < 4; ++camera) {
          const std::vector<uint8_t> rgb = images.interleaved(0, camera);
          frame.append(rgb.begin(), rgb.end());
        }
        frames.push_back(frame);
      });
  ASSERT_EQ(replay.images.groups.size(), 2u);
  std::string all;
  for (const std::string& frame : frames) all += frame;
  EXPECT_EQ(unpack_images(replay.cameras, replay.images.groups[0], kReplayFramesPerGroup) +
                unpack_images(replay.cameras, replay.images.groups[1], 11),
            all);
  EXPECT_GT(std::count_if(all.begin(), all.end(), [](char c) { return c != 0; }), 10000);
}

TEST(Recorder, RefusesUnsupportedOptions) {
  const std::unique_ptr<Simulator> simulator = town(kAgents);
  EXPECT_THAT(message_of([&] { Recorder(*simulator, {.world = 2}); }), HasSubstr("expected a world of 0 to 1, got 2"));
  EXPECT_THAT(message_of([&] { Recorder(*simulator, {.world = 1, .followed = kAgents}); }),
              HasSubstr("expected an agent of 0 to 29 to follow, got 30"));
  Recorder recorder(*simulator, {.world = 1});
  const std::vector<Command> few(3);
  EXPECT_THAT(message_of([&] { recorder.before_step(few); }), HasSubstr("expected 37 commands, got 3"));
}

}  // namespace
}  // namespace pictura
