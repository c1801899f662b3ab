// Messages to live pages, and driving by keys, in running worlds.
#include "pictura/replay/live.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/tests/map/open_roads.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<Simulator> make_town(int agents) {
  SimulatorConfig config;
  config.seed = 3;
  config.num_threads = 1;
  config.episode_steps = 40;
  config.pedestrian_fraction = config.cyclist_fraction = 0;
  return make_simulator("cpu", config, {load_map("procedural:1:blocks=2x2")}, {{0, agents, 0}});
}

TEST(LiveWorld, SendsTheContentOfARecording) {
  // Two simulators of one seed: one is recorded whole, the other is sent frame by frame.
  const auto recorded = make_town(8), told = make_town(8);
  const auto controller = make_host_controller("random", *recorded, 1);
  Recorder recorder(*recorded, {});
  LiveWorld live(*told, {}, {}, false);
  EXPECT_EQ(live.begin()["header"]["frames"], 1);
  std::vector<Command> commands(8);
  for (int frame = 1; frame <= 60; ++frame) {
    controller->act(recorded->arrays(), {}, commands);
    recorder.before_step(commands);
    recorder.after_step(recorded->step(commands));
    live.before_step(commands);
    live.after_step(told->step(commands));
    const LiveJson message = live.frame();
    const Replay& whole = recorder.recorded();
    EXPECT_EQ(message["step"], frame);
    for (size_t track = 0; track < kNumTracks; ++track) {
      for (int agent = 0; agent < 8; ++agent) {
        ASSERT_EQ(message["tracks"][track][agent], whole.at(static_cast<Track>(track), frame, agent))
            << kTracks[track].name << ", agent " << agent << ", frame " << frame;
      }
    }
    const bool begins = whole.episodes.back().first_frame == frame;
    EXPECT_EQ(!message["episode"].is_null(), begins);
    EXPECT_EQ(message["metrics"]["agent_steps"], whole.metrics.agent_steps);
  }
  EXPECT_GT(recorder.recorded().episodes.size(), 1u);
  // A page that connects now begins with this frame and the current goal chains.
  const LiveJson begin = live.begin();
  EXPECT_EQ(begin["step"], 60);
  EXPECT_EQ(begin["header"]["frames"], 1);
}

TEST(LiveWorld, SendsTheBodiesOfAgentsThatEnter) {
  SimulatorConfig config;
  config.num_threads = 1;
  config.parked_cars = 0;
  const auto map = std::make_shared<RoadMap>(parse_opendrive(test::open_street(120), "street.xodr"));
  const auto simulator = make_simulator("cpu", config, {map}, {{0, 4, 0}});
  const auto controller = make_host_controller("idm_lanes", *simulator, 1);
  LiveWorld live(*simulator, {}, {}, false);
  std::vector<Command> commands(4);
  int64_t entered = 0;
  for (int step = 0; step < 200; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    live.before_step(commands);
    live.after_step(simulator->step(commands));
    const LiveJson message = live.frame();
    for (const LiveJson& agent : message["entered"]) {
      ++entered;
      ASSERT_EQ(agent.size(), 5 + kNumConditioning);
      const size_t slot = agent[0];
      EXPECT_EQ(agent[2], replay_box(simulator->scene().agents[slot]).body.length_cm);
      EXPECT_EQ(agent[5], simulator->state().conditioning[slot * kNumConditioning]);
    }
  }
  EXPECT_GT(entered, 0);
  EXPECT_EQ(entered, simulator->spawn_report().entered);
}

TEST(LiveWorld, DiscardingKeepsTheNewestChains) {
  const auto simulator = make_town(8);
  const auto controller = make_host_controller("lane", *simulator, 1);
  Recorder recorder(*simulator, {});
  std::vector<Command> commands(8);
  for (int step = 0; step < 30; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    recorder.before_step(commands);
    recorder.after_step(simulator->step(commands));
  }
  std::vector<ReplayChain> newest(8);
  for (const ReplayChain& chain : recorder.recorded().episodes.back().chains) {
    newest[chain.agent] = chain;
  }
  recorder.discard_history();
  const Replay& kept = recorder.recorded();
  EXPECT_EQ(kept.num_frames, 1);
  EXPECT_EQ(kept.tracks[0].size(), 8u);
  for (const ReplayChain& chain : kept.episodes.back().chains) {
    EXPECT_EQ(chain.frame, 0);
    EXPECT_EQ(chain.x_cm, newest[chain.agent].x_cm);
  }
}

TEST(LiveRequest, ErrorsNameInvalidFields) {
  const auto complaint = [](std::string_view text) -> std::string {
    try {
      parse_live_request(text, 4);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(complaint(R"({"paused": true, "steps": 3, "pace": 2, "watch": 3, "drive": -1, "keys": ["left"]})"), "");
  EXPECT_THAT(complaint("{\"watch\": 4}"), HasSubstr("watch: expected a number of 0 to 3, got 4"));
  EXPECT_THAT(complaint("{\"steps\": 1e30}"), HasSubstr("steps: expected a number"));
  EXPECT_THAT(complaint("{\"keys\": \"left\"}"), HasSubstr("keys: expected"));
  EXPECT_THAT(complaint("[]"), HasSubstr("expected an object"));
  EXPECT_THAT(complaint("{\"paused\": " + std::string(100'000, '[') + std::string(100'000, ']') + "}"),
              HasSubstr("expected JSON"));
}

// State of one vehicle after some steps under these keys.
struct Driven {
  float speed_mps, heading_rad, accel_mps2;
};
Driven drive(Simulator& simulator, const DrivingKeys& keys, int steps) {
  std::vector<Command> commands(1);
  for (int step = 0; step < steps; ++step) {
    commands[0].action = action_of_keys(keys, simulator.state(), 0, simulator.config().dt_s);
    simulator.step(commands);
  }
  const AgentStateView state = simulator.state();
  return {state.speed_mps[0], state.heading_rad[0], state.accel_long_mps2[0]};
}

TEST(Keyboard, SpeedsUpHoldsTurnsStopsAndReverses) {
  const auto simulator = make_town(1);
  const Driven rest = drive(*simulator, {.stop = true}, 12);
  EXPECT_NEAR(rest.speed_mps, 0, 0.3f);
  const Driven fast = drive(*simulator, {.forward = true}, 9);
  EXPECT_GT(fast.speed_mps, 0.8f);
  const Driven let_go = drive(*simulator, {}, 7);
  EXPECT_NEAR(let_go.accel_mps2, 0, 0.2f);
  EXPECT_GT(let_go.speed_mps, fast.speed_mps);
  const Driven left = drive(*simulator, {.left = true}, 5);
  EXPECT_GT(std::remainder(left.heading_rad - let_go.heading_rad, 6.2831853f), 0.005f);
}

TEST(Keyboard, StandsStillWhileStopIsHeld) {
  const auto simulator = make_town(1);
  drive(*simulator, {.stop = true}, 25);
  for (int step = 0; step < 8; ++step) {
    EXPECT_NEAR(drive(*simulator, {.stop = true}, 1).speed_mps, 0, 0.12f);
  }
  EXPECT_LT(drive(*simulator, {.backward = true}, 6).speed_mps, -0.1f);
}

}  // namespace
}  // namespace pictura
