// Evaluations in recorded scenes: the same figures as a simulator that is driven by hand, whatever the batches, and
// what becomes of scenes that cannot be used.
#include "pictura/training/evaluation/evaluate_scenes.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/file.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/training/evaluation/evaluate.h"
#include "pictura/training/evaluation/scene_plan.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

class SceneEvaluations : public ::testing::Test {
 protected:
  SceneEvaluations() {
    options_.controller = "random";
    options_.device = "cpu";
    options_.num_threads = 1;
    options_.scenes = {folder_.path()};
    options_.protocol.steps = 60;
    options_.on_agent = [this](const SceneAgent& agent) { agents_ += csv_line(agent); };
  }

  /// A scene of its own seed and id.
  void write(int number, const test::FixtureOptions& fixture = {}) const {
    test::FixtureOptions its = fixture;
    its.seed = static_cast<uint64_t>(number);
    Scenario scene = *test::crossing(its);
    scene.id = fmt::format("scene{}", number);
    write_scene_file(folder_ / fmt::format("{}.scenario", number), scene);
  }

  /// All agents' rows, and the table.
  std::string figures() {
    agents_.clear();
    const SceneEvaluation evaluation = evaluate_scenes(options_);
    for (const SceneRow& row : evaluation.rows) {
      agents_ += fmt::format("{} {} {}", row.density, row.scenes, row.vehicle_episodes);
      for (const auto& [name, estimate] : metrics_of(row)) {
        agents_ += fmt::format(" {} {:.9g} {:.9g}", name, estimate.value, estimate.half_width_95);
      }
      agents_ += '\n';
    }
    return agents_;
  }

  test::ScratchFolder folder_;
  SceneEvaluateOptions options_;
  std::string agents_;
};

TEST_F(SceneEvaluations, AreTheSameForAnyBatch) {
  for (int i = 1; i <= 5; ++i) write(i, {.num_vehicles = 4 + 2 * i});
  options_.scenes_at_once = 1;
  const std::string one_by_one = figures();
  EXPECT_THAT(one_by_one, HasSubstr("\"scene5\",0.5,"));
  for (const int at_once : {2, 5, 100}) {
    options_.scenes_at_once = at_once;
    EXPECT_EQ(figures(), one_by_one) << at_once;
  }
  options_.num_threads = 2;
  EXPECT_EQ(figures(), one_by_one);
  options_.seed = 2;
  EXPECT_NE(figures(), one_by_one);
  // A part of the scenes gives their rows.
  options_.seed = 1;
  options_.first_scene = 3;
  options_.num_scenes = 1;
  const std::string fourth = figures();
  EXPECT_THAT(one_by_one, HasSubstr(fourth.substr(0, fourth.find("\n1 1 "))));
}

/// What a hand-driven simulator counts of the evaluation's scene.
TEST_F(SceneEvaluations, EqualASimulatorThatIsDrivenByHand) {
  write(1);
  for (const char* rules : {"", "after_infraction=drive_on", "after_infraction=leave", "overlapping=drive"}) {
    SCOPED_TRACE(rules);
    options_.protocol = scene_protocol("womd");
    options_.protocol.steps = 120;
    options_.protocol.densities = {0.75};
    if (*rules) set_scene_rule(rules, &options_.protocol);
    std::vector<SceneAgent> agents;
    options_.on_agent = [&agents](const SceneAgent& agent) { agents.push_back(agent); };
    const SceneEvaluation evaluation = evaluate_scenes(options_);
    ASSERT_EQ(evaluation.rows.size(), 1u);

    const SceneProtocol& protocol = options_.protocol;
    const auto scene = protocol_scene(load_scenario(folder_ / "1.scenario"), protocol);
    SimulatorConfig config = protocol_config(protocol, {});
    config.seed = options_.seed;
    const auto map = compile_scenario(scene, map_options(config));
    const auto simulator =
        make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map, 0, kFirstEvaluationWorld)});
    const ScenePlan plan = plan_scene(*map, simulator->scene().agents, protocol, 0.75, options_.seed);
    const auto random = make_controller("random", *simulator, options_.seed);
    std::vector<Command> commands(scene->tracks.size());
    std::vector<int32_t> driven, removed;
    for (size_t i = 0; i < commands.size(); ++i) {
      if (plan.roles[i] == SceneRole::driven) driven.push_back(int32_t(i));
      if (plan.roles[i] == SceneRole::removed) removed.push_back(int32_t(i));
    }
    ASSERT_GE(driven.size(), 2u);
    int64_t steps = 0;
    for (int step = 0; step < protocol.steps; ++step) {
      random->act(simulator->controller_input(), {}, commands);
      for (size_t i = 0; i < commands.size(); ++i) {
        if (plan.roles[i] == SceneRole::removed) commands[i].kind = CommandKind::absent;
        if (plan.roles[i] == SceneRole::replayed) commands[i].kind = CommandKind::recorded;
      }
      const StepResult result = simulator->step(Span<const Command>(commands));
      for (const uint8_t valid : result.valid) steps += valid;
    }
    EXPECT_EQ(evaluation.agent_steps, steps);
    ASSERT_EQ(agents.size(), driven.size());
    const AgentStateView state = simulator->state();
    for (size_t i = 0; i < driven.size(); ++i) {
      const int32_t slot = driven[i];
      EXPECT_EQ(agents[i].track_id, scene->tracks[size_t(slot)].id);
      EXPECT_EQ(agents[i].events, state.episode_events[slot]);
      EXPECT_EQ(agents[i].arrived, state.goals_reached[slot] > 0);
      EXPECT_EQ(agents[i].distance_m, state.distance_m[slot]);
    }
  }
}

TEST_F(SceneEvaluations, RecordedActionsArriveAndAreRemoved) {
  write(1, {.num_vehicles = 1, .num_pedestrians = 3, .num_cyclists = 0});
  options_.controller = "inverse";
  options_.protocol.steps = 600;
  options_.protocol.densities = {1.0};
  const SceneEvaluation evaluation = evaluate_scenes(options_);
  const SceneRow& row = evaluation.rows.at(0);
  EXPECT_EQ(row.vehicle_episodes, 1);
  EXPECT_EQ(row.goal_rate.value, 1) << agents_;
  EXPECT_EQ(row.collision_rate.value, 0);
  EXPECT_LT(row.mean_displacement_m.value, 0.2);
  EXPECT_LE(evaluation.agent_steps, 91) << "nobody drives on after the goal";
  options_.protocol.leave_at_goal = false;
  EXPECT_EQ(evaluate_scenes(options_).agent_steps, 600);
}

TEST_F(SceneEvaluations, LeaveOutWhatCannotBeUsed) {
  write(1);
  write(2, {.num_vehicles = 1, .num_pedestrians = 2, .num_cyclists = 0});
  // A scene of parked vehicles alone.
  Scenario parked = *test::crossing();
  for (size_t track = 0; track < parked.tracks.size(); ++track) {
    for (int32_t step = 0; step < parked.num_steps; ++step) {
      const size_t at = track * size_t(parked.num_steps) + size_t(step);
      if (parked.valid[at])
        parked.states[at] = parked.states[track * size_t(parked.num_steps) + size_t(parked.tracks[track].last_valid)];
    }
  }
  write_scene_file(folder_ / "3.scenario", parked);
  write_file(folder_ / "4.json", "{\"objects\": 3}");
  Scenario slow = *test::crossing();
  slow.dt_s = 0.2f;
  write_scene_file(folder_ / "5.scenario", slow);
  const SceneEvaluation evaluation = evaluate_scenes(options_);
  EXPECT_EQ(evaluation.found, 5);
  EXPECT_EQ(evaluation.scored, 2);
  EXPECT_EQ(evaluation.without_drivers, 1);
  ASSERT_EQ(evaluation.faults.size(), 2u);
  EXPECT_THAT(evaluation.faults[0], HasSubstr("4.json"));
  EXPECT_THAT(evaluation.faults[1], ::testing::AllOf(HasSubstr("5.scenario"), HasSubstr("expected time steps")));

  options_.protocol.control = "4711";
  EXPECT_EQ(evaluate_scenes(options_).without_drivers, 3);
  options_.scenes = {folder_ / "4.json"};
  EXPECT_THAT(test::message_of<Error>([&] { evaluate_scenes(options_); }), HasSubstr("4.json"));
  options_.scenes = {folder_ / "1.scenario"};
  options_.protocol.control = "self,vehicles";
  options_.protocol.start_step = 200;
  EXPECT_THAT(test::message_of<Error>([&] { evaluate_scenes(options_); }), HasSubstr("in [0, 91), got 200"));
  options_.first_scene = 1;
  EXPECT_THAT(test::message_of<UsageError>([&] { evaluate_scenes(options_); }), HasSubstr("in [0, 1), got 1"));
}

TEST_F(SceneEvaluations, TakeOverLaterAndLetTheRecordVanish) {
  Scenario late = *test::crossing({.num_vehicles = 1, .num_pedestrians = 3, .num_cyclists = 0});
  int32_t mover = 0;
  while (!is_moving(late, mover)) ++mover;
  const auto at = static_cast<size_t>(mover);
  for (size_t step = 0; step < 7; ++step) {
    late.valid[at * size_t(late.num_steps) + step] = 0;
    late.states[at * size_t(late.num_steps) + step] = {};
  }
  late.tracks[at].first_valid = 7;
  late.tracks[at].num_valid -= 7;
  write_scene_file(folder_ / "1.scenario", late);
  options_.controller = "idle";
  options_.protocol.densities = {1.0};
  options_.protocol.steps = 100;
  EXPECT_EQ(evaluate_scenes(options_).without_drivers, 1);
  options_.protocol.late = Late::drive;
  options_.protocol.record_end = RecordEnd::vanish;
  std::vector<SceneAgent> agents;
  options_.on_agent = [&agents](const SceneAgent& agent) { agents.push_back(agent); };
  evaluate_scenes(options_);
  ASSERT_EQ(agents.size(), 1u);
  EXPECT_EQ(agents[0].takeover_step, 7);
  EXPECT_GT(agents[0].driven_steps, 5);
}

TEST(SceneSamples, AreEvaluated) {
  const char* data = std::getenv("PICTURA_DATA");
  if (!data || !std::filesystem::is_directory(std::string(data) + "/womd")) GTEST_SKIP() << "no samples";
  SceneEvaluateOptions options;
  options.controller = "idm";
  options.device = "cpu";
  options.scenes = {std::string(data) + "/womd", std::string(data) + "/gpudrive"};
  options.protocol.densities = {1.0};
  const SceneEvaluation evaluation = evaluate_scenes(options);
  EXPECT_EQ(evaluation.scored, 3);
  EXPECT_TRUE(evaluation.faults.empty());
  EXPECT_GT(evaluation.rows[0].vehicle_episodes, 10);
  EXPECT_GT(evaluation.rows[0].goal_rate.value, 0.3);
  for (const char* rule : {"overlapping=drive", "others=absent", "late=drive", "late=absent", "record_end=vanish",
                           "after_infraction=leave", "leave_at_goal=no", "waypoints=path", "box_scale=0.7"}) {
    SCOPED_TRACE(rule);
    options.protocol = scene_protocol("womd");
    set_scene_rule(rule, &options.protocol);
    EXPECT_EQ(evaluate_scenes(options).scored, 3);
  }
}

}  // namespace
}  // namespace pictura
