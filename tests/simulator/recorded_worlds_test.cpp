// Worlds of recorded scenes: agents that follow their recorded tracks, and controllers that take over from the tracks.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/simulator/controllers/idm.h"
#include "pictura/simulator/controllers/inverse_actions.h"
#include "pictura/simulator/controllers/shared_control.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/simulator/scene_recorder.h"
#include "pictura/simulator/simulator_setup.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"

namespace pictura {
namespace {

using test::crossing;
using ::testing::HasSubstr;

constexpr test::FixtureOptions kNobodyInTheWay{.num_vehicles = 1, .num_pedestrians = 3, .num_cyclists = 0};

std::unique_ptr<Simulator> world_of(const std::shared_ptr<const Scenario>& scene, int32_t start_step = 0,
                                    SimulatorConfig config = {}) {
  config = scene_config(*scene, start_step, config);
  const auto map = compile_scenario(scene, map_options(config), start_step);
  return make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
}

const std::vector<Command>& recorded(const Simulator& simulator) {
  static std::vector<Command> commands;
  commands.assign(simulator.num_slots(), Command{.kind = CommandKind::recorded});
  return commands;
}

AgentStatus status_of(Simulator& simulator, int slot) { return simulator.state().status[slot]; }

/// Expects every agent to be where the recording has it at this step, or absent.
void expect_as_recorded(Simulator& simulator, const Scenario& scene, int32_t step) {
  const Span<const AgentBox> boxes = simulator.scene().agents;
  for (int32_t track = 0; track < static_cast<int32_t>(scene.tracks.size()); ++track) {
    SCOPED_TRACE(::testing::Message() << "track " << track << ", step " << step);
    const auto at = static_cast<size_t>(step);
    const AgentBox& box = boxes[track];
    const bool is_present = scene.valid_of(track)[at] != 0;
    ASSERT_EQ(box.drawn != 0, is_present);
    ASSERT_EQ(status_of(simulator, track), is_present ? AgentStatus::recorded : AgentStatus::absent);
    const RecordedTrack& about = scene.tracks[track];
    ASSERT_EQ(box.length_m, about.length_m);
    ASSERT_EQ(box.height_m, about.height_m);
    if (!is_present) continue;
    const TrackState& state = scene.states_of(track)[at];
    ASSERT_LT(length((box.center_m - state.position_m).xy()), 1e-3f);
    ASSERT_LT(std::abs(box.center_m.z - state.position_m.z), 1);  // on the road, where the record is near a road
    ASSERT_LT(std::abs(wrap_angle(simulator.state().heading_rad[track] - state.heading_rad)), 1e-5f);
    ASSERT_EQ(simulator.state().events[track], kEventNone);
  }
}

TEST(RecordedWorlds, AgentsAppearMoveAndVanishAsRecorded) {
  const auto scene = crossing();
  bool someone_vanishes = false, someone_appears = false;
  for (int32_t track = 0; track < static_cast<int32_t>(scene->tracks.size()); ++track) {
    for (size_t step = 1; step < static_cast<size_t>(scene->num_steps); ++step) {
      const Span<const uint8_t> valid = scene->valid_of(track);
      someone_vanishes = someone_vanishes || (valid[step - 1] && !valid[step]);
      someone_appears = someone_appears || (!valid[step - 1] && valid[step]);
    }
  }
  ASSERT_TRUE(someone_vanishes && someone_appears);
  const auto simulator = world_of(scene);
  EXPECT_EQ(simulator->spawn_report().spawned, static_cast<int64_t>(scene->tracks.size()));
  expect_as_recorded(*simulator, *scene, 0);
  for (int32_t step = 1; step < scene->num_steps; ++step) {
    const StepResult result = simulator->step(recorded(*simulator));
    for (const uint8_t valid : result.valid) ASSERT_EQ(valid, 0);
    expect_as_recorded(*simulator, *scene, step);
  }
  EXPECT_EQ(simulator->episode_over()[0], 1);
  EXPECT_EQ(simulator->totals().agent_steps, 0);
  EXPECT_EQ(simulator->totals().collisions + simulator->totals().off_road, 0);
  // The next episode is the same.
  simulator->step(recorded(*simulator));
  expect_as_recorded(*simulator, *scene, 0);
}

TEST(RecordedWorlds, StartAtAChosenStep) {
  const auto scene = crossing();
  const auto simulator = world_of(scene, 10);
  expect_as_recorded(*simulator, *scene, 10);
  simulator->step(recorded(*simulator));
  expect_as_recorded(*simulator, *scene, 11);
  EXPECT_EQ(simulator->config().episode_steps, scene->num_steps - 11);
  EXPECT_THAT(test::message_of<UsageError>([&] { compile_scenario(scene, {}, scene->num_steps); }),
              HasSubstr("expected a start step in [0, 91), got 91"));
}

TEST(RecordedWorlds, ReplayedTracksAreBoxesThatFollowTheRecord) {
  const auto scene = crossing();
  SimulatorConfig config = scene_config(*scene);
  config.reset_inactive_fraction = 1;
  config.leave_at_goal = true;
  config.parked_cars = static_cast<int>(scene->tracks.size());
  const auto whole = compile_scenario(scene, map_options(config));
  // Two moving vehicles drive without jerk; the others, among them pedestrians, are replayed.
  std::vector<int32_t> driven, replayed;
  for (int32_t track = static_cast<int32_t>(scene->tracks.size()); track-- > 0;) {
    const bool drives = driven.size() < 2 && is_moving(*scene, track) && scene->valid_of(track)[0];
    (drives ? driven : replayed).push_back(track);
  }
  ASSERT_EQ(driven.size(), 2u);
  constexpr int kAgents = 5;
  const auto map = with_tracks(*whole, driven, replayed, kAgents);
  EXPECT_NE(map->fingerprint, whole->fingerprint);
  EXPECT_NE(map->fingerprint, with_tracks(*whole, driven, driven, kAgents)->fingerprint);
  const auto simulator = make_simulator("cpu", config, CompiledMaps{map}, {{0, kAgents, 0}, {0, 1, 1}});
  EXPECT_EQ(simulator->spawn_report().spawned, 2 + 1);
  EXPECT_THAT(test::message_of<UsageError>([&] { SceneRecorder(*simulator, 0); }), HasSubstr("one with chosen tracks"));
  // Worlds of the same scene in which all tracks are agents that follow the record.
  const auto as_agents = world_of(scene, 0, {.auxiliary_observations = true});
  const std::vector<int32_t> actions(kAgents + 1, kIdleAction);
  int32_t step = 0;
  for (; !simulator->episode_over()[0]; ++step) {
    ASSERT_LT(step, config.episode_steps);
    for (int slot = 2; slot < kAgents; ++slot) ASSERT_EQ(status_of(*simulator, slot), AgentStatus::absent);
    for (const int first : {kAgents, kAgents + config.parked_cars + 1}) {  // other boxes of either world
      for (int i = 0; i < config.parked_cars; ++i) {
        SCOPED_TRACE(::testing::Message() << "box " << first + i << ", step " << step);
        const AgentBox& box = simulator->scene().agents[static_cast<size_t>(first + i)];
        const bool is_track = i < static_cast<int>(replayed.size());
        const AgentBox expected = is_track ? as_agents->scene().agents[static_cast<size_t>(replayed[i])] : AgentBox{};
        ASSERT_EQ(box.drawn, is_track && expected.drawn);
        if (!box.drawn) continue;
        ASSERT_EQ(box.agent_class, expected.agent_class);
        ASSERT_EQ(box.length_m, expected.length_m);
        ASSERT_EQ(box.center_m.x, expected.center_m.x);
        ASSERT_EQ(box.center_m.y, expected.center_m.y);
        ASSERT_NEAR(box.center_m.z, expected.center_m.z, 0.1f);
        ASSERT_EQ(box.cos_heading, expected.cos_heading);
      }
    }
    simulator->step(Array(actions));
    as_agents->step(recorded(*as_agents));
  }
  EXPECT_GT(simulator->totals().agent_steps, 0);
  // The episode ended because no driven agent drives any more, or at its full length.
  const bool any_drives =
      status_of(*simulator, 0) == AgentStatus::active || status_of(*simulator, 1) == AgentStatus::active;
  EXPECT_EQ(any_drives, step == config.episode_steps);
  const auto refusal = [&](const std::vector<int32_t>& tracks, int agents) {
    return test::message_of<UsageError>([&] { with_tracks(*whole, tracks, replayed, agents); });
  };
  EXPECT_THAT(refusal(driven, 1), HasSubstr("expected 1 to 1 driven tracks, got 2"));
  EXPECT_THAT(refusal({}, 1), HasSubstr("got 0"));
  EXPECT_THAT(
      test::message_of<UsageError>([&] { make_simulator("cpu", config, CompiledMaps{map}, {{0, kAgents + 1, 0}}); }),
      HasSubstr("expected at most 5 agents"));
}

TEST(RecordedWorlds, ReplayedTracksAreObservedAndHitLikeAgents) {
  const auto scene = crossing(kNobodyInTheWay);
  SimulatorConfig config = scene_config(*scene);
  config.parked_cars = 8;
  const auto whole = compile_scenario(scene, map_options(config));
  std::vector<int32_t> others;
  for (int32_t track = 1; track < static_cast<int32_t>(scene->tracks.size()); ++track) others.push_back(track);
  const auto map = with_tracks(*whole, std::vector<int32_t>{0}, others, 1);
  config.parked_cars = static_cast<int>(others.size());
  const auto simulator = make_simulator("cpu", config, CompiledMaps{map}, {{0, 1, 0}});
  config.parked_cars = 0;
  const auto as_agents = make_simulator("cpu", config, CompiledMaps{whole}, {scene_world(*whole)});
  for (int step = 0; step < 40; ++step) {
    const Span<const float> partners = simulator->observations().partners,
                            expected = as_agents->observations().partners.subspan(0, partners.size());
    for (size_t i = 0; i < partners.size(); ++i) ASSERT_NEAR(partners[i], expected[i], 1e-3f) << "step " << step;
    ASSERT_TRUE(std::any_of(partners.begin(), partners.end(), [](float value) { return value != 0; }));
    const std::vector<int32_t> own{kIdleAction};
    simulator->step(Array(own));
    std::vector<Command> commands = recorded(*as_agents);
    commands[0] = {};
    as_agents->step(commands);
    ASSERT_EQ(simulator->state().events[0], as_agents->state().events[0]) << "step " << step;
  }
}

std::unique_ptr<Simulator> lit_world_of(const std::shared_ptr<const Scenario>& scene, int32_t start_step = 0) {
  const SimulatorConfig config = scene_config(*scene, start_step);
  MapOptions options = map_options(config);
  options.recorded_lights = true;
  const auto map = compile_scenario(scene, options, start_step);
  return make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
}

/// Returns the crossing with one constant state of all lights.
std::shared_ptr<const Scenario> crossing_with(RecordedLightState state) {
  Scenario scene = *crossing(kNobodyInTheWay);
  std::fill(scene.light_states.begin(), scene.light_states.end(), state);
  return std::make_shared<const Scenario>(std::move(scene));
}

TEST(RecordedWorlds, RecordedLightsShowTheirRecordedStatesIfConfigured) {
  constexpr int32_t kStart = 7;
  const auto scene = crossing();
  ASSERT_EQ(world_of(scene)->scene().light_states.size(), 0u);
  const auto simulator = lit_world_of(scene, kStart);
  const CompiledMap& map = *simulator->maps()[0];
  ASSERT_EQ(map.road->lights.size(), scene->lights.size());
  EXPECT_EQ(map.geometry.heads.size(), scene->lights.size());
  EXPECT_NE(map.fingerprint, world_of(scene, kStart)->maps()[0]->fingerprint);
  int changes = 0;
  for (int32_t step = kStart; step < scene->num_steps; ++step) {
    const Span<const LightState> shown = simulator->scene().light_states;
    for (int32_t light = 0; light < static_cast<int32_t>(scene->lights.size()); ++light) {
      const Span<const RecordedLightState> states = scene->states_of_light(light);
      const auto at = static_cast<size_t>(step);
      const LightState is = shown[light];
      EXPECT_EQ(is == LightState::red,
                states[at] == RecordedLightState::stop || states[at] == RecordedLightState::arrow_stop)
          << light << ", " << step;
      EXPECT_EQ(is == LightState::green,
                states[at] == RecordedLightState::go || states[at] == RecordedLightState::arrow_go);
      EXPECT_EQ(is == LightState::unknown, states[at] == RecordedLightState::none);
      changes += step > kStart && states[at] != states[at - 1];
    }
    simulator->step(recorded(*simulator));
  }
  EXPECT_GT(changes, 0);
}

TEST(RecordedWorlds, RedRecordedLightsStopDrivenAgents) {
  const auto crosses = [](Simulator& simulator) {
    std::vector<Command> commands = recorded(simulator);
    commands[0] = {.action = kIdleAction};
    for (int step = 0; step < 60; ++step) simulator.step(commands);
    return simulator.totals().red_light;
  };
  EXPECT_EQ(crosses(*lit_world_of(crossing_with(RecordedLightState::stop))), 1);
  EXPECT_EQ(crosses(*lit_world_of(crossing_with(RecordedLightState::flashing_stop))), 0);
  EXPECT_EQ(crosses(*lit_world_of(crossing_with(RecordedLightState::go))), 0);
  EXPECT_EQ(crosses(*lit_world_of(crossing_with(RecordedLightState::none))), 0);
  EXPECT_EQ(crosses(*world_of(crossing_with(RecordedLightState::stop))), 0);
  // Lights do not hold agents that follow records.
  const auto replay = lit_world_of(crossing_with(RecordedLightState::stop));
  for (int step = 0; step < 60; ++step) replay->step(recorded(*replay));
  EXPECT_EQ(replay->totals().red_light, 0);
}

TEST(RecordedWorlds, RecordedLightsAreObserved) {
  const auto controls = [](Simulator& simulator) {
    return simulator.observations().set_counts[static_cast<size_t>(EntitySet::controls)];
  };
  EXPECT_GT(controls(*lit_world_of(crossing())), controls(*world_of(crossing())));
}

TEST(RecordedWorlds, StandStillAfterTheEndOfTheRecord) {
  const auto scene = crossing();
  SimulatorConfig config = scene_config(*scene);
  config.episode_steps = scene->num_steps + 20;
  const auto map = compile_scenario(scene, map_options(config));
  const auto simulator = make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
  for (int32_t step = 1; step < scene->num_steps + 10; ++step) simulator->step(recorded(*simulator));
  expect_as_recorded(*simulator, *scene, scene->num_steps - 1);
  for (int slot = 0; slot < simulator->num_slots(); ++slot) {
    if (status_of(*simulator, slot) != AgentStatus::recorded) continue;
    EXPECT_EQ(simulator->state().speed_mps[slot], 0);
  }
}

/// Returns the first track that moves and is valid from step 0 to `last`.
int32_t mover(const Scenario& scene, size_t last) {
  for (int32_t track = 0; track < static_cast<int32_t>(scene.tracks.size()); ++track) {
    const Span<const uint8_t> valid = scene.valid_of(track);
    bool is_present = true;
    for (size_t step = 0; step <= last; ++step) is_present = is_present && valid[step];
    if (is_present && is_moving(scene, track) && scene.tracks[track].type == TrackType::vehicle) {
      return track;
    }
  }
  return -1;
}

TEST(RecordedWorlds, AnActionStartsFromTheRecordedMotion) {
  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40);
  ASSERT_GE(self, 0);
  for (const int32_t taken_at : {0, 17}) {
    const auto simulator = world_of(scene);
    for (int32_t step = 0; step < taken_at; ++step) simulator->step(recorded(*simulator));
    std::vector<Command> commands = recorded(*simulator);
    commands[self] = {};  // no jerk
    const StepResult result = simulator->step(commands);
    EXPECT_EQ(result.valid[self], 1);
    EXPECT_EQ(status_of(*simulator, self), AgentStatus::active) << int{simulator->state().halt_reason[self]};
    // The agent continues straight at the recorded speed.
    const TrackState& from = scene->states_of(self)[taken_at];
    const float speed_mps = length(from.velocity_mps);
    const AgentBox& box = simulator->scene().agents[self];
    EXPECT_NEAR(simulator->state().speed_mps[self], speed_mps, 1e-3);
    EXPECT_NEAR(length((box.center_m - from.position_m).xy()), speed_mps * 0.1f, 1e-3);
    EXPECT_EQ(simulator->totals().agent_steps, 1);
    // All other agents continue as recorded. The agent can return to its record.
    simulator->step(recorded(*simulator));
    expect_as_recorded(*simulator, *scene, taken_at + 2);
  }
}

TEST(RecordedWorlds, DrivenAgentsCollideWithRecordedTracksAndHalt) {
  const auto scene = crossing();
  const int32_t self = mover(*scene, 40);
  const auto simulator = world_of(scene);
  // Place the agent onto another that is present.
  int32_t other = 0;
  while (other == self || !scene->valid_of(other)[1]) ++other;
  std::vector<Command> commands = recorded(*simulator);
  Command& onto = commands[self];
  const TrackState& there = scene->states_of(other)[1];
  onto = {.kind = CommandKind::kinematic_state,
          .x_m = there.position_m.x,
          .y_m = there.position_m.y,
          .z_m = there.position_m.z,
          .heading_rad = there.heading_rad,
          .speed_mps = 5};
  simulator->step(commands);
  EXPECT_EQ(status_of(*simulator, self), AgentStatus::halted);
  EXPECT_EQ(status_of(*simulator, other), AgentStatus::recorded);
  EXPECT_EQ(simulator->totals().collisions, 1);
  // Halted agents stay where they are, whichever controller commands them.
  const AgentBox before = simulator->scene().agents[self];
  simulator->step(recorded(*simulator));
  EXPECT_EQ(status_of(*simulator, self), AgentStatus::halted);
  EXPECT_EQ(simulator->scene().agents[self].center_m.x, before.center_m.x);
}

TEST(RecordedWorlds, TheGoalIsTheEndOfTheRecordAndIsPassedOnce) {
  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40);
  const auto simulator = world_of(scene);
  const AgentStateView state = simulator->state();
  EXPECT_EQ(state.next_waypoint[self], kNumWaypoints - 1);
  const RecordedTrack& track = scene->tracks[self];
  const auto follow_by_states = [&](int32_t step) {
    std::vector<Command> commands = recorded(*simulator);
    const auto at = static_cast<size_t>(std::min(step, track.last_valid));
    if (!scene->valid_of(self)[at]) return commands;
    const TrackState& there = scene->states_of(self)[at];
    const float ahead_m = reference_to_center(AgentClass::vehicle, track.length_m);
    commands[self] = {.kind = CommandKind::kinematic_state,
                      .x_m = there.position_m.x - ahead_m * std::cos(there.heading_rad),
                      .y_m = there.position_m.y - ahead_m * std::sin(there.heading_rad),
                      .z_m = there.position_m.z,
                      .heading_rad = there.heading_rad,
                      .speed_mps = length(there.velocity_mps)};
    return commands;
  };
  for (int32_t step = 1; step < scene->num_steps; ++step) simulator->step(follow_by_states(step));
  EXPECT_EQ(simulator->totals().goals_reached, 1);
  EXPECT_EQ(simulator->totals().waypoints_reached, 1);
}

/// Returns the scene's world under other rules of how agents end, with all other agents as recorded.
std::unique_ptr<Simulator> world_with(const std::shared_ptr<const Scenario>& scene, AfterInfraction after,
                                      bool leave_at_goal) {
  SimulatorConfig config;
  config.after_infraction = after;
  config.leave_at_goal = leave_at_goal;
  return world_of(scene, 0, config);
}

Command place(const Scenario& scene, int32_t track, const TrackState& at) {
  const RecordedTrack& about = scene.tracks[track];
  const float ahead_m = reference_to_center(AgentClass::vehicle, about.length_m);
  return {.kind = CommandKind::kinematic_state,
          .x_m = at.position_m.x - ahead_m * std::cos(at.heading_rad),
          .y_m = at.position_m.y - ahead_m * std::sin(at.heading_rad),
          .z_m = at.position_m.z,
          .heading_rad = at.heading_rad,
          .speed_mps = length(at.velocity_mps)};
}

TEST(RecordedWorlds, ArrivedAgentsLeaveWithoutLaterCollisions) {
  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40), other = self + 1;
  const auto simulator = world_with(scene, AfterInfraction::halt, /*leave_at_goal=*/true);
  const RecordedTrack& track = scene->tracks[self];
  const TrackState& goal = scene->states_of(self)[track.last_valid];
  std::vector<Command> commands = recorded(*simulator);
  commands[self] = place(*scene, self, goal);
  StepResult result = simulator->step(commands);
  const auto slot = static_cast<size_t>(self);
  EXPECT_EQ(result.terminated[slot], 1);
  EXPECT_EQ(result.truncated[slot], 0);
  EXPECT_EQ(status_of(*simulator, self), AgentStatus::absent);
  EXPECT_EQ(simulator->state().goals_reached[self], 1);
  EXPECT_EQ(simulator->scene().agents[slot].drawn, 1) << "all see where it arrived";
  const std::vector<uint8_t> saved = simulator->save();
  // Another agent reaches the same place without a collision. The world ignores commands to the agent that left.
  commands[other] = place(*scene, other, goal);
  commands[slot] = {};
  result = simulator->step(commands);
  EXPECT_EQ(result.valid[slot], 0);
  EXPECT_EQ(simulator->scene().agents[slot].drawn, 0);
  EXPECT_EQ(simulator->totals().collisions, 0);
  EXPECT_EQ(simulator->totals().goals_reached, 1);
  // The steps from a saved state are the same. Worlds under other rules reject the state.
  const uint64_t hash = simulator->state_hash();
  simulator->restore(saved);
  simulator->step(commands);
  EXPECT_EQ(simulator->state_hash(), hash);
  const auto usual = world_of(scene);
  EXPECT_THAT(test::message_of<Error>([&] { usual->restore(saved); }), HasSubstr("fingerprints"));
  EXPECT_THAT(test::message_of<Error>([&] { simulator->restore(usual->save()); }), HasSubstr("way to end"));
}

TEST(RecordedWorlds, InfractionsHaltOrRemoveOrOnlyCount) {
  const auto scene = crossing();
  const int32_t self = mover(*scene, 40);
  TrackState aside = scene->states_of(self)[0];
  const SinCos heading = sincos_of(aside.heading_rad);
  aside.position_m = aside.position_m + Vec3{8 * heading.sin, -8 * heading.cos, 0};
  for (const AfterInfraction after : {AfterInfraction::halt, AfterInfraction::leave, AfterInfraction::drive_on}) {
    SCOPED_TRACE(static_cast<int>(after));
    const auto simulator = world_with(scene, after, false);
    std::vector<Command> commands = recorded(*simulator);
    commands[self] = place(*scene, self, aside);
    EXPECT_EQ(simulator->step(commands).terminated[self], after != AfterInfraction::drive_on);
    const AgentStatus expected = after == AfterInfraction::halt    ? AgentStatus::halted
                                 : after == AfterInfraction::leave ? AgentStatus::absent
                                                                   : AgentStatus::active;
    EXPECT_EQ(status_of(*simulator, self), expected);
    EXPECT_EQ(simulator->state().episode_events[self] & kEventOffRoad, kEventOffRoad);
    simulator->step(commands);
    EXPECT_EQ(simulator->totals().off_road, after == AfterInfraction::drive_on ? 2 : 1);
    EXPECT_EQ(simulator->scene().agents[self].drawn, after != AfterInfraction::leave);
  }
}

TEST(RecordedWorlds, ObservedPiecesAreCutFromWholeLines) {
  const auto scene = crossing();
  const auto longest_m = [&](float span_m) {
    const auto map = compile_scenario(scene, {.walls = false, .observed_span_m = span_m});
    float longest = 0, sum = 0;
    for (const ObservedPiece& piece : map->rules.lane_pieces) {
      longest = std::max(longest, 2 * piece.half_length_m);
      sum += 2 * piece.half_length_m;
    }
    return std::pair(longest, sum);
  };
  const auto [usual_m, whole_m] = longest_m(0);
  EXPECT_LE(usual_m, kMaxPiece_m + 1e-3f);
  for (const float span_m : {2.0f, 5.0f, 20.0f}) {
    const auto [longest, sum] = longest_m(span_m);
    EXPECT_LE(longest, span_m + 1e-3f);
    EXPECT_GT(longest, 0.9f * span_m) << "straight lanes of 40 m are whole before they are cut";
    EXPECT_NEAR(sum, whole_m, 0.01f * whole_m);
  }
}

TEST(RecordedWorlds, DrivenAgentsLeaveTheRoadAtRoadEdges) {
  const auto scene = crossing();
  const int32_t self = mover(*scene, 40);
  const auto simulator = world_of(scene);
  const TrackState& there = scene->states_of(self)[0];
  std::vector<Command> commands = recorded(*simulator);
  const SinCos heading = sincos_of(there.heading_rad);
  Command& aside = commands[self];
  aside = {.kind = CommandKind::kinematic_state,
           .x_m = there.position_m.x + 8 * heading.sin,
           .y_m = there.position_m.y - 8 * heading.cos,
           .z_m = there.position_m.z,
           .heading_rad = there.heading_rad,
           .speed_mps = 1};
  simulator->step(commands);
  EXPECT_EQ(status_of(*simulator, self), AgentStatus::halted);
  EXPECT_EQ(simulator->totals().off_road, 1);
}

TEST(RecordedWorlds, AreSavedAndRestored) {
  const auto scene = crossing();
  const auto a = world_of(scene), b = world_of(scene);
  for (int i = 0; i < 30; ++i) a->step(recorded(*a));
  b->restore(a->save());
  EXPECT_EQ(a->state_hash(), b->state_hash());
  a->step(recorded(*a));
  b->step(recorded(*b));
  EXPECT_EQ(a->state_hash(), b->state_hash());
  // Another start is another record.
  const auto later = world_of(scene, 1, {});
  EXPECT_THAT(test::message_of<Error>([&] { later->restore(a->save()); }), HasSubstr("the saved state differs in"));
}

TEST(RecordedWorlds, WorldsWithTheLargestBoxAreRestored) {
  for (int i = 0; i < 50; ++i) {
    Scenario large = *crossing();
    large.tracks[0].length_m = 15.0f + 0.137f * static_cast<float>(i);
    large.tracks[0].width_m = 2.5f + 0.011f * static_cast<float>(i);
    const auto simulator = world_of(std::make_shared<const Scenario>(large));
    const std::vector<uint8_t> saved = simulator->save();
    EXPECT_NO_THROW(simulator->restore(saved)) << large.tracks[0].length_m << " by " << large.tracks[0].width_m;
  }
}

TEST(RecordedWorlds, MasksDivideTracksAmongControllers) {
  const auto scene = crossing();
  const auto simulator = world_of(scene);
  const auto log = make_controller("log", *simulator, 0), idle = make_controller("idle", *simulator, 0);
  std::vector<uint8_t> driven(scene->tracks.size());
  driven[mover(*scene, 40)] = 1;
  std::vector<Command> commands(scene->tracks.size());
  log->act(simulator->arrays(), {}, commands);
  idle->act(simulator->arrays(), driven, commands);
  simulator->step(commands);
  EXPECT_EQ(simulator->totals().agent_steps, 1);
}

void expect_inverse_actions_to_follow_the_record(const DynamicsRules& rules) {
  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40);
  const auto simulator = world_of(scene, 0, {.dynamics = rules});
  const InverseActions inverse = find_inverse_actions(*simulator->maps()[0], simulator->config().dt_s, 0, rules);
  std::vector<Driver> drivers;
  drivers.push_back({.controller = make_controller("log", *simulator, 0)});
  std::vector<uint8_t> driven(scene->tracks.size());
  driven[self] = 1;
  drivers.push_back(driver_of(make_controller("inverse", *simulator, 0), driven));
  SharedControl control(std::move(drivers));
  EXPECT_EQ(control.name(), "log, inverse");
  std::vector<Command> commands(scene->tracks.size());
  const auto first = static_cast<size_t>(self * inverse.num_steps);
  for (int32_t step = 1; step <= 40; ++step) {
    control.act(simulator->arrays(), {}, commands);
    simulator->step(commands);
    // The dynamics follow the predicted states, which are near the record.
    const TrackState& there = scene->states_of(self)[step];
    const float error_m = length((simulator->scene().agents[self].center_m - there.position_m).xy());
    const size_t at = first + static_cast<size_t>(step) - 1;
    ASSERT_EQ(inverse.is_followed[at], 1);
    EXPECT_NEAR(inverse.error_m[at], error_m, 0.02) << step;
    EXPECT_LT(error_m, 0.1) << step;
  }
  EXPECT_EQ(simulator->totals().agent_steps, 40);
}

TEST(RecordedWorlds, InverseActionsFollowTheRecord) {
  expect_inverse_actions_to_follow_the_record({});
  expect_inverse_actions_to_follow_the_record({.reset_at_standstill = true});
}

/// Returns the maximum distance to its record of a bus that makes a quarter turn to the left on an arc of `radius_m`.
float largest_error_of_bus(float length_m, float radius_m, float first_speed_mps) {
  Scenario scene = *crossing({.num_steps = 160});
  const int32_t self = mover(scene, 40);
  const float steps_m = 6;  // distance over which the curvature grows and ends
  scene.tracks[self].length_m = length_m;
  float s = 0, x = 0, y = 0, heading = 0, speed = first_speed_mps;
  for (int32_t step = 0; step < scene.num_steps; ++step) {
    const size_t at = static_cast<size_t>(self) * static_cast<size_t>(scene.num_steps) + static_cast<size_t>(step);
    const SinCos along = sincos_of(heading);
    scene.valid[at] = 1;
    scene.states[at] = {{x, y, 0}, heading, Vec2{along.cos, along.sin} * speed};
    const float into_turn = s - 25, turn_m = radius_m * 0.5f * kPi;
    const float share = std::clamp(std::min(into_turn, turn_m + steps_m - into_turn) / steps_m, 0.0f, 1.0f);
    const float wanted = into_turn < -15 || into_turn > turn_m ? 8.0f : 5.0f;
    speed += 0.1f * std::clamp(wanted - speed, -2.0f, 1.2f);
    s += 0.1f * speed;
    heading += 0.1f * speed * share / radius_m;
    x += 0.1f * speed * along.cos;
    y += 0.1f * speed * along.sin;
  }
  RecordedTrack& track = scene.tracks[self];
  track.first_valid = 0;
  track.last_valid = scene.num_steps - 1;
  track.num_valid = scene.num_steps;
  const auto simulator = world_of(std::make_shared<const Scenario>(scene));
  const InverseActions inverse = find_inverse_actions(*simulator->maps()[0], simulator->config().dt_s);
  const auto first = inverse.error_m.begin() + self * inverse.num_steps;
  return *std::max_element(first, first + inverse.num_steps);
}

TEST(RecordedWorlds, InverseActionsOfLongVehiclesReturnToTheRecord) {
  for (const float radius_m : {12.0f, 15.0f, 20.0f}) {
    for (const float speed_mps : {0.0f, 3.0f, 7.0f}) {
      EXPECT_LT(largest_error_of_bus(13.8f, radius_m, speed_mps), 0.5f) << radius_m << " m, " << speed_mps << " m/s";
    }
  }
  EXPECT_LT(largest_error_of_bus(18, 15, 7), 0.5f);
}

TEST(RecordedWorlds, IdmFollowsThePathAndStopsBehindOthers) {
  const IdmParameters parameters;
  EXPECT_FLOAT_EQ(idm_acceleration(parameters, 0, INFINITY, 0), 2);
  EXPECT_FLOAT_EQ(idm_acceleration(parameters, 0, 2, 0), 0);
  EXPECT_FLOAT_EQ(idm_acceleration(parameters, 30, INFINITY, 0), 0);
  EXPECT_LT(idm_acceleration(parameters, 10, 5, 0), -4);

  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40), other = self + 1;
  for (const bool is_blocked : {false, true}) {
    const auto simulator = world_of(scene);
    const RecordedState& end = simulator->maps()[0]->rules.record.states[(self + 1) * scene->num_steps - 1];
    const TrackState& blocked_at = scene->states_of(self)[60];
    const auto idm = make_controller("idm", *simulator, 0);
    std::vector<uint8_t> driven(scene->tracks.size());
    driven[self] = 1;
    float fastest_mps = 0;
    for (int32_t step = 1; step < scene->num_steps; ++step) {
      std::vector<Command> commands = recorded(*simulator);
      idm->act(simulator->arrays(), driven, commands);
      if (is_blocked) {
        commands[other] = {.kind = CommandKind::kinematic_state,
                           .x_m = blocked_at.position_m.x,
                           .y_m = blocked_at.position_m.y,
                           .z_m = blocked_at.position_m.z};
      }
      simulator->step(commands);
      fastest_mps = std::max(fastest_mps, simulator->state().speed_mps[self]);
      // The bus never leaves its path.
      const TrackState& start = scene->states_of(self)[0];
      const Vec2 along{std::cos(start.heading_rad), std::sin(start.heading_rad)};
      const Vec3 center_m = simulator->scene().agents[self].center_m;
      EXPECT_LT(std::abs(cross(along, (center_m - start.position_m).xy())), 0.05f);
    }
    EXPECT_EQ(simulator->totals().collisions, 0);
    EXPECT_LT(simulator->state().speed_mps[self], 0.3f);
    const float left_m = length(Vec2{simulator->state().x_m[self], simulator->state().y_m[self]} - end.position_m.xy());
    if (is_blocked) {
      EXPECT_GT(left_m, 5);
    } else {
      EXPECT_GT(fastest_mps, 1.2f * length(scene->states_of(self)[0].velocity_mps));
      EXPECT_LT(left_m, 0.6f);
    }
  }
}

TEST(RecordedWorlds, IdmFollowsLanesIfConfigured) {
  const auto scene = crossing(kNobodyInTheWay);
  const int32_t self = mover(*scene, 40);
  const auto simulator = world_of(scene);
  const auto idm = make_controller("idm_lanes", *simulator, 0);
  EXPECT_EQ(idm->name(), "idm_lanes");
  std::vector<uint8_t> driven(scene->tracks.size());
  driven[self] = 1;
  constexpr int32_t kTakeover = 15, kMerged = 45;  // the takeover is in the middle of the record
  constexpr int32_t kNearsEnd = 80;                // near the end of its lane, where the agent stops
  float driven_m = 0;
  for (int32_t step = 1; step < scene->num_steps; ++step) {
    std::vector<Command> commands = recorded(*simulator);
    const AgentStateView state = simulator->state();
    const float before_mps = state.speed_mps[self];
    if (step > kTakeover) idm->act(simulator->arrays(), driven, commands);
    simulator->step(commands);
    if (step <= kTakeover) continue;
    driven_m += 0.1f * state.speed_mps[self];
    // The agent's speed approaches the lane's limit from the recorded speed, above or below the limit. The agent also
    // approaches the lane's centre line.
    if (step > kTakeover + 1 && step < kNearsEnd && before_mps < state.speed_limit_mps[self]) {
      EXPECT_GE(state.speed_mps[self], before_mps - 0.01f) << step;
    }
    if (step > kMerged && state.lane[self] >= 0) {
      EXPECT_LT(std::abs(state.lane_offset_m[self]), 0.3f) << step;
    }
  }
  EXPECT_GT(driven_m, 20);
  EXPECT_EQ(simulator->state().speed_mps[self], 0);
  EXPECT_EQ(simulator->totals().collisions + simulator->totals().off_road, 0);
}

TEST(RecordedWorlds, IdmFollowsLanesWithoutARecord) {
  SimulatorConfig config;
  config.pedestrian_fraction = 0.2f;
  config.cyclist_fraction = 0.1f;
  config.parked_cars = 0;
  config.fixed_lights = true;
  config.reset_inactive_fraction = 1;
  uint64_t hash[2] = {};
  for (const bool told : {false, true}) {
    const auto town = make_simulator("cpu", config, {load_map("procedural:1")}, {{0, 12, 0}, {0, 5, 1}});
    const auto idm = make_controller(told ? "idm_lanes" : "idm", *town, 0);
    std::vector<Command> commands(static_cast<size_t>(town->num_slots()));
    const AgentStateView state = town->state();
    for (int step = 1; step <= 500; ++step) {
      idm->act(town->arrays(), {}, commands);
      town->step(commands);
      for (int slot = 0; slot < town->num_slots(); ++slot) {
        if (status_of(*town, slot) != AgentStatus::active) continue;
        if (state.agent_class[slot] == AgentClass::pedestrian) {
          EXPECT_EQ(state.speed_mps[slot], 0);
          continue;
        }
        if (step < 50) continue;
        ASSERT_GE(state.lane[slot], 0);
        EXPECT_LT(std::abs(state.lane_offset_m[slot]), 0.5f) << slot << " at " << step;
        EXPECT_LE(state.speed_mps[slot], IdmParameters{}.wanted_mps);
      }
    }
    EXPECT_GT(town->totals().distance_m, 1000);
    EXPECT_EQ(town->totals().red_light, 0);
    hash[told] = town->state_hash();
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(RecordedWorlds, PathsAlongLanesEndWithTheirLanes) {
  const auto scene = crossing(kNobodyInTheWay);
  const auto simulator = world_of(scene);
  const MapView map = simulator->maps()[0]->rules.view();
  const Vec3 here{3, 4, 0};
  const FollowedPath nowhere = path_along_lanes(map, -1, here, 1, 4);
  ASSERT_EQ(nowhere.points_m.size(), 1u);
  EXPECT_EQ(nowhere.at(10).position_m.x, here.x);
  for (int32_t lane = 0; lane < static_cast<int32_t>(map.lanes.size()); ++lane) {
    const MapLane& about = map.lanes[lane];
    if (about.num_segments == 0) continue;
    const LanePose begin = pose_on_lane(map, lane, 0);
    const FollowedPath path = path_along_lanes(map, lane, begin.position_m, begin.heading_rad, 4);
    EXPECT_TRUE(path.ends);  // as all lanes of the recording do
    EXPECT_GE(path.length_m(), about.length_m - 1);
    const float middle_m = 0.5f * std::min(path.length_m(), about.length_m);
    const Vec3 on_path = path.at(middle_m).position_m;
    EXPECT_LT(length((on_path - pose_on_lane(map, lane, middle_m).position_m).xy()), 0.5f) << lane;
  }
}

TEST(RecordedWorlds, RefuseInvalidOptions) {
  const auto scene = crossing();
  const SimulatorConfig config = scene_config(*scene);
  const auto map = compile_scenario(scene, map_options(config));
  EXPECT_THAT(test::message_of<UsageError>([&] { make_simulator("cpu", config, CompiledMaps{map}, {{0, 3, 0}}); }),
              HasSubstr("expected as many agents as scene"));
  SimulatorConfig slow = config;
  slow.dt_s = 0.05f;
  EXPECT_THAT(
      test::message_of<UsageError>([&] { make_simulator("cpu", slow, CompiledMaps{map}, {scene_world(*map)}); }),
      HasSubstr("dt_s: expected the 0.1 s of scene"));
  const auto town = make_simulator("cpu", {}, {load_map("procedural:1")}, {{0, 2, 0}});
  EXPECT_THAT(test::message_of<UsageError>([&] { make_controller("log", *town, 0); }),
              HasSubstr("world 0: expected a recorded scene"));
  EXPECT_THAT(test::message_of<Error>([&] { town->step(recorded(*town)); }),
              HasSubstr("slot 0: expected a world on a recorded scene"));
  const auto simulator = world_of(scene);
  EXPECT_THAT(test::message_of<UsageError>([&] { make_controller("lane", *simulator, 0); }),
              HasSubstr("expected a map of roads, got recorded scene"));
}

TEST(RecordedWorlds, WordsSelectTracks) {
  const auto scene = crossing();
  const auto count = [&](const std::string& words) {
    int sum = 0;
    for (const uint8_t is_in : tracks_of(*scene, words)) sum += is_in;
    return sum;
  };
  EXPECT_EQ(count("self"), 1);
  EXPECT_EQ(count("self,vehicles,others"), static_cast<int>(scene->tracks.size()));
  EXPECT_EQ(count("vehicles"), 7);
  EXPECT_EQ(count("others"), 4);
  EXPECT_EQ(count(std::to_string(scene->tracks[2].id) + "," + std::to_string(scene->tracks[3].id)), 2);
  EXPECT_THAT(test::message_of<UsageError>([&] { tracks_of(*scene, "cars"); }), HasSubstr("got 'cars'"));
  EXPECT_THAT(test::message_of<UsageError>([&] { tracks_of(*scene, "4"); }), HasSubstr("selects none of its 12"));
}

TEST(RecordedWorlds, SamplesAreReplayed) {
  for (const char* name : {"womd", "gpudrive", "pufferdrive"}) {
    const std::string folder = map_folder() + "/" + name;
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is missing";
    for (const SceneRef& ref : index_scenes(folder).scenes) {
      SCOPED_TRACE(ref.file);
      const auto scene = std::make_shared<const Scenario>(load_scenario(ref));
      const auto simulator = world_of(scene);
      for (int32_t step = 1; step < scene->num_steps; ++step) {
        simulator->step(recorded(*simulator));
        if (step % 10 == 0) expect_as_recorded(*simulator, *scene, step);
      }
    }
  }
}

}  // namespace
}  // namespace pictura
