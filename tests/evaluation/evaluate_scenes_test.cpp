// Evaluations in recorded scenes give the results of a simulator that the test drives itself, whatever the batches.
// Also the treatment of scenes that cannot be used.
#include "pictura/evaluation/evaluate_scenes.h"

#include <cstring>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/math.h"
#include "pictura/common/support/file.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/evaluation/scene_plan.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"

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

  /// Writes a scene with its own seed and id.
  void write(int number, const test::FixtureOptions& fixture = {}) const {
    test::FixtureOptions its = fixture;
    its.seed = static_cast<uint64_t>(number);
    Scenario scene = *test::crossing(its);
    scene.id = fmt::format("scene{}", number);
    write_scene_file(folder_ / fmt::format("{}.scenario", number), scene);
  }

  /// Returns all agents' rows, and the table.
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

TEST_F(SceneEvaluations, DoNotDependOnBatchSize) {
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
  // A range of the scenes gives their rows.
  options_.seed = 1;
  options_.first_scene = 3;
  options_.num_scenes = 1;
  const std::string fourth = figures();
  EXPECT_THAT(one_by_one, HasSubstr(fourth.substr(0, fourth.find("\n1 1 "))));
}

/// Counts of a hand-driven simulator for the evaluation's scene.
TEST_F(SceneEvaluations, EqualAManuallyDrivenSimulator) {
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
      random->act(simulator->arrays(), {}, commands);
      for (size_t i = 0; i < commands.size(); ++i) {
        if (plan.roles[i] == SceneRole::removed) commands[i].kind = CommandKind::absent;
        if (plan.roles[i] == SceneRole::replayed) commands[i].kind = CommandKind::recorded;
      }
      const StepResult result = simulator->step(Span<const Command>(commands));
      for (const uint8_t valid : result.valid) steps += valid;
    }
    EXPECT_EQ(evaluation.results.agent_steps(), steps);
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
  EXPECT_LE(evaluation.results.agent_steps(), 91) << "nobody drives on after the goal";
  options_.protocol.leave_at_goal = false;
  EXPECT_EQ(evaluate_scenes(options_).results.agent_steps(), 600);
}

TEST_F(SceneEvaluations, SkipUnusableScenes) {
  write(1);
  write(2, {.num_vehicles = 1, .num_pedestrians = 2, .num_cyclists = 0});
  // Scene of parked vehicles only.
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
  EXPECT_EQ(evaluation.results.scored(), 2);
  EXPECT_EQ(evaluation.results.without_drivers, 1);
  ASSERT_EQ(evaluation.faults().size(), 2u);
  EXPECT_THAT(evaluation.faults()[0], HasSubstr("4.json"));
  EXPECT_THAT(evaluation.faults()[1], ::testing::AllOf(HasSubstr("5.scenario"), HasSubstr("expected time steps")));

  options_.protocol.control = "4711";
  EXPECT_EQ(evaluate_scenes(options_).results.without_drivers, 3);
  options_.scenes = {folder_ / "4.json"};
  EXPECT_THAT(test::message_of<Error>([&] { evaluate_scenes(options_); }), HasSubstr("4.json"));
  options_.scenes = {folder_ / "1.scenario"};
  options_.protocol.control = "self,vehicles";
  options_.protocol.start_step = 200;
  EXPECT_THAT(test::message_of<Error>([&] { evaluate_scenes(options_); }), HasSubstr("in [0, 91), got 200"));
  options_.first_scene = 1;
  EXPECT_THAT(test::message_of<UsageError>([&] { evaluate_scenes(options_); }), HasSubstr("in [0, 1), got 1"));
}

TEST_F(SceneEvaluations, SupportLaterTakeoverAndVanishingTracks) {
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
  EXPECT_EQ(evaluate_scenes(options_).results.without_drivers, 1);
  options_.protocol.late = Late::drive;
  options_.protocol.record_end = RecordEnd::vanish;
  std::vector<SceneAgent> agents;
  options_.on_agent = [&agents](const SceneAgent& agent) { agents.push_back(agent); };
  evaluate_scenes(options_);
  ASSERT_EQ(agents.size(), 1u);
  EXPECT_EQ(agents[0].takeover_step, 7);
  EXPECT_GT(agents[0].driven_steps, 5);
}

TEST_F(SceneEvaluations, PartsMergeIntoTheWhole) {
  for (int i = 1; i <= 5; ++i) write(i, {.num_vehicles = 4 + 2 * i});
  write_file(folder_ / "6.json", "{\"objects\": 3}");
  Scenario slow = *test::crossing();
  slow.dt_s = 0.2f;
  write_scene_file(folder_ / "3.scenario", slow);
  options_.protocol = scene_protocol("pufferdrive2");
  options_.protocol.densities = {1.0, 0.5};
  set_scene_rule("rollouts=2", &options_.protocol);
  const test::ScratchFolder files;
  options_.hashes_scenes = true;
  write_results(files / "whole", evaluate_scenes(options_).results);
  std::vector<SceneResults> parts;
  std::vector<std::string> names;
  const auto add_part = [&](int first, int count) {
    options_.first_scene = first;
    options_.num_scenes = count;
    names.push_back(files / fmt::format("{}.json", first));
    write_results(names.back(), evaluate_scenes(options_).results);
    EXPECT_TRUE(has_scene_results(names.back()));
    parts.push_back(read_scene_results(names.back()));
  };
  add_part(4, 100);  // there are two of these
  add_part(0, 2);
  add_part(2, 2);
  write_results(files / "merged", merge(parts, names));
  EXPECT_EQ(read_file(files / "merged"), read_file(files / "whole"));
  const SceneResults merged = merge(parts, names);
  EXPECT_EQ(merged.scored(), 4);
  EXPECT_EQ(merged.num_scenes, 6);
  EXPECT_EQ(merged.faults.size(), 2u);

  const auto refusal = [&] { return test::message_of<Error>([&] { merge(parts, names); }); };
  parts[2].first_scene = 3;
  EXPECT_THAT(refusal(), HasSubstr("2.json: begins with scene 3: expected 2, the next after those of"));
  parts[2].first_scene = 1;
  EXPECT_THAT(refusal(), HasSubstr("begins with scene 1: expected 2"));
  parts[2].first_scene = 2;
  parts[2].protocol.box_scale = 1;
  EXPECT_THAT(refusal(), ::testing::AllOf(HasSubstr("rules.box_scale is"), HasSubstr("2.json")));
  parts[2].protocol.box_scale = 0.7f;
  parts[2].setting.seed = 2;
  EXPECT_THAT(refusal(), HasSubstr("seed is 2, in "));
  parts[2].setting.seed = parts[0].setting.seed;
  EXPECT_EQ(refusal(), test::kNoError);
  write(1, {.num_vehicles = 5});
  parts.pop_back();
  names.pop_back();
  add_part(2, 2);
  EXPECT_THAT(refusal(), HasSubstr("2.json: maps_hash is \""));
  write_file(files / "bad.json", R"({"format": "pictura evaluation 1"})");
  EXPECT_FALSE(has_scene_results(files / "bad.json"));
  EXPECT_FALSE(has_scene_results(folder_ / "1.scenario"));
  EXPECT_THAT(test::message_of<Error>([&] { read_scene_results(files / "bad.json"); }),
              HasSubstr("expected \"format\": \"pictura evaluation in scenes 1\""));
}

TEST_F(SceneEvaluations, KeepRolloutsOfAllPresentAgents) {
  write(1);
  write(2, {.num_vehicles = 6});
  options_.protocol = scene_protocol("simagents");
  std::vector<SceneRollouts> scenes;
  options_.on_rollouts = [&scenes](const SceneRollouts& scene) { scenes.push_back(scene); };
  const SceneEvaluation evaluation = evaluate_scenes(options_);
  ASSERT_EQ(scenes.size(), 2u);
  EXPECT_EQ(scenes[1].scenario_id, "scene2");
  const Scenario scene = load_scenario(folder_ / "1.scenario");
  std::vector<int64_t> ids;
  std::vector<int32_t> tracks;
  for (int32_t track = 0; track < static_cast<int32_t>(scene.tracks.size()); ++track) {
    if (!scene.valid_of(track)[10]) continue;
    ids.push_back(scene.tracks[size_t(track)].id);
    tracks.push_back(track);
  }
  EXPECT_EQ(scenes[0].track_ids, ids);
  ASSERT_EQ(scenes[0].rollouts.size(), 32u);
  EXPECT_EQ(evaluation.rows[0].vehicle_episodes % 32, 0);
  std::set<float> ends;
  for (const std::vector<SimulatedState>& rollout : scenes[0].rollouts) {
    ASSERT_EQ(rollout.size(), ids.size() * 80);
    ends.insert(rollout[79].x_m);
    // A step of 0.1 s cannot lead farther.
    for (size_t i = 0; i < ids.size(); ++i) {
      const TrackState& start = scene.states_of(tracks[i])[10];
      const SimulatedState& first = rollout[i * 80];
      EXPECT_NEAR(first.x_m, scene.map.origin_m[0] + double(start.position_m.x), 3.5);
      EXPECT_NEAR(first.y_m, scene.map.origin_m[1] + double(start.position_m.y), 3.5);
      const float height_m = scene.tracks[size_t(tracks[i])].height_m;
      EXPECT_NEAR(first.z_m, scene.map.origin_m[2] + double(start.position_m.z + height_m / 2), 0.01);
      EXPECT_LE(std::abs(first.heading_rad), kPi);
    }
  }
  EXPECT_GT(ends.size(), 1u) << "draws differ between rollouts";

  // Agents that follow the recording are at the recorded position, in the file's coordinates; lost agents keep theirs.
  scenes.clear();
  options_.protocol.control = "self";
  evaluate_scenes(options_);
  for (size_t i = 0; i < ids.size(); ++i) {
    if (tracks[i] == scene.sdc_track) continue;
    const RecordedTrack& track = scene.tracks[size_t(tracks[i])];
    const SimulatedState* last = nullptr;
    for (int32_t step = 11; step < 91; ++step) {
      const SimulatedState& state = scenes[0].rollouts[5][i * 80 + size_t(step) - 11];
      if (!scene.valid_of(tracks[i])[size_t(step)]) {
        EXPECT_TRUE(!last || std::memcmp(&state, last, sizeof state) == 0) << track.id << " at " << step;
        continue;
      }
      const TrackState& recorded = scene.states_of(tracks[i])[size_t(step)];
      EXPECT_NEAR(state.x_m, scene.map.origin_m[0] + double(recorded.position_m.x), 2e-3);
      EXPECT_NEAR(state.y_m, scene.map.origin_m[1] + double(recorded.position_m.y), 2e-3);
      EXPECT_NEAR(wrap_angle(state.heading_rad - recorded.heading_rad), 0, 1e-5);
      last = &state;
    }
  }

  options_.protocol = scene_protocol("womd");
  EXPECT_THAT(test::message_of<UsageError>([&] { evaluate_scenes(options_); }),
              HasSubstr("expected 32 rollouts of 80 steps from step 10"));
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
  EXPECT_EQ(evaluation.results.scored(), 3);
  EXPECT_TRUE(evaluation.faults().empty());
  EXPECT_GT(evaluation.rows[0].vehicle_episodes, 10);
  EXPECT_GT(evaluation.rows[0].goal_rate.value, 0.3);
  for (const char* rule : {"overlapping=drive", "others=absent", "late=drive", "late=absent", "record_end=vanish",
                           "after_infraction=leave", "leave_at_goal=no", "waypoints=path", "box_scale=0.7"}) {
    SCOPED_TRACE(rule);
    options.protocol = scene_protocol("womd");
    set_scene_rule(rule, &options.protocol);
    EXPECT_EQ(evaluate_scenes(options).results.scored(), 3);
  }
}

}  // namespace
}  // namespace pictura
