// Training in recorded scenes: the roles, starts and goals of agents are those of evaluations, and all scenes are used
// in turn.
#include "pictura/training/scene_sets.h"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/evaluation/evaluate_scenes.h"
#include "pictura/evaluation/scene_plan.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/training_maps.h"

namespace pictura {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SceneSetsTest : public ::testing::Test {
 protected:
  /// Writes a scene with an id of its number; without drivers, all of its road users walk.
  void write(int number, test::FixtureOptions fixture = {}, bool has_drivers = true) const {
    fixture.seed = static_cast<uint64_t>(number);
    Scenario scene = *test::crossing(fixture);
    scene.id = std::to_string(number);
    if (!has_drivers) {
      scene.sdc_track = -1;
      for (RecordedTrack& track : scene.tracks) track.type = TrackType::pedestrian;
    }
    write_scene_file(folder_ / fmt::format("{}.scenario", number), scene);
  }
  std::string maps() const { return fmt::format("simulator.maps=[\"scenes:{}\"]", folder_.path()); }
  /// Configuration of two worlds in the folder's scenes.
  Config config(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> overrides{maps(),
                                       "simulator.num_slots=24",
                                       "simulator.max_agents=12",
                                       "run.num_threads=2",
                                       "simulator.min_agents=1",
                                       "policy.modality=vector"};
    overrides.insert(overrides.end(), more.begin(), more.end());
    return parse_config("", "test", overrides);
  }
  /// Ids of a set's scenes by world.
  static std::vector<std::string> ids(const SceneSet& set) {
    std::vector<std::string> result;
    for (const WorldSpec& world : set.worlds) result.push_back(set.maps[static_cast<size_t>(world.map)]->scenario->id);
    return result;
  }
  static SceneSets make_sets(const Config& config) {
    const std::vector<WorldSpec> worlds = draw_training_worlds(config);
    return {config, training_world(config, {}), worlds, static_cast<int>(worlds.size())};
  }

  test::ScratchFolder folder_;
};

TEST_F(SceneSetsTest, RolesStartsAndGoalsEqualThoseOfEvaluations) {
  write(1, {.num_vehicles = 14});
  for (const char* name : {"gpudrive", "womd", "waymax"}) {
    SCOPED_TRACE(name);
    const Config config =
        this->config({fmt::format("simulator.scenes.protocol={}", name), "simulator.scenes.max_replayed=3"});
    const SceneProtocol protocol = scene_protocol(name);
    const SimulatorConfig world = training_world(config, {});
    EXPECT_EQ(world.after_infraction, protocol.after_infraction);
    EXPECT_EQ(world.leave_at_goal, protocol.leave_at_goal);
    EXPECT_EQ(world.episode_steps, protocol.steps);
    constexpr int kAgents = 12;
    const auto map = compile_training_scene(find_scene(folder_.path()), protocol, world, kAgents);
    ASSERT_TRUE(map);
    // The same scene as evaluations have it.
    const auto whole =
        compile_scenario(protocol_scene(load_scenario(folder_.path()), protocol),
                         {.walls = false, .observed_span_m = protocol.observed_span_m}, protocol.start_step);
    SimulatorConfig without_cars = world;
    without_cars.parked_cars = 0;
    const auto evaluated = make_simulator("cpu", without_cars, CompiledMaps{whole}, {scene_world(*whole)});
    const ScenePlan plan = plan_scene(*whole, evaluated->scene().agents, protocol, 1, 1);
    const auto training = make_simulator("cpu", world, CompiledMaps{map}, {{0, kAgents, 0}});
    ASSERT_EQ(training->num_slots(), kAgents);
    int slot = 0;
    for (size_t track = 0; track < plan.roles.size(); ++track) {
      if (plan.roles[track] != SceneRole::driven) continue;
      const AgentStateView a = training->state(), b = evaluated->state();
      const auto other = static_cast<int>(track);
      for (const auto& [own, its] : {std::pair{a.x_m, b.x_m},
                                     {a.y_m, b.y_m},
                                     {a.z_m, b.z_m},
                                     {a.speed_mps, b.speed_mps},
                                     {a.heading_rad, b.heading_rad},
                                     {a.goal_x_m, b.goal_x_m},
                                     {a.goal_y_m, b.goal_y_m},
                                     {a.length_m, b.length_m}}) {
        EXPECT_EQ(own[slot], its[other]) << "slot " << slot;
      }
      ++slot;
    }
    EXPECT_GT(slot, 0);
    for (int i = slot; i < kAgents; ++i) EXPECT_EQ(training->state().status[i], AgentStatus::absent);
    const auto num_replayed =
        static_cast<size_t>(std::count(plan.roles.begin(), plan.roles.end(), SceneRole::replayed));
    EXPECT_EQ(map->rules.record.agents.size(), kAgents + std::min<size_t>(num_replayed, 3));
  }
}

TEST_F(SceneSetsTest, ChosenRoadUsersDriveAndTheOthersAreReplayed) {
  write(1);
  const auto driven = [&](const std::vector<std::string>& more) -> int {
    const Config config = this->config(more);
    const auto map = compile_training_scene(find_scene(folder_.path()), config.simulator.scenes.training_protocol(),
                                            training_world(config, {}), 12);
    if (!map) return 0;
    const auto training = make_simulator("cpu", training_world(config, {}), CompiledMaps{map}, {{0, 12, 0}});
    return static_cast<int>(training->spawn_report().spawned);
  };
  const auto all = driven({});
  EXPECT_GT(all, 2);
  EXPECT_EQ(driven({"simulator.scenes.control=self"}), 1);
  EXPECT_EQ(driven({"simulator.scenes.rules=[\"max_driven=2\"]"}), 2);
  EXPECT_GT(driven({"simulator.scenes.control=self,vehicles,others"}), all);
  EXPECT_EQ(driven({"simulator.scenes.rules=[\"least_way_m=1000\"]"}), 0);
}

TEST_F(SceneSetsTest, ScenesAlternateAndUnusableOnesAreReplaced) {
  write(1);
  write(2, {}, /*has_drivers=*/false);
  write(3);
  std::ofstream(folder_ / "4.scenario") << "no scene";
  write(5);
  SceneSets sets = make_sets(config());
  const SceneSet first = sets.take(0), second = sets.take(1);
  EXPECT_THAT(ids(first), ElementsAre("1", "3"));   // the second is replaced by the third
  EXPECT_THAT(ids(second), ElementsAre("3", "5"));  // the fourth by the fifth
  EXPECT_THAT(ids(sets.take(2)), ElementsAre("5", "1"));
  EXPECT_EQ(first.maps[1], second.maps[0]) << "not compiled again";
  EXPECT_EQ(first.seed, config().run.seed);
  EXPECT_NE(second.seed, first.seed);
  EXPECT_THAT(sets.take_notices(),
              ::testing::UnorderedElementsAre(HasSubstr("1 scenes without road users"),
                                              AllOf(HasSubstr("left out"), HasSubstr("4.scenario"))));
  EXPECT_TRUE(sets.take_notices().empty());
  // A set does not depend on the sets taken before it.
  SceneSets others = make_sets(config());
  const SceneSet later = others.take(1);
  EXPECT_EQ(ids(later), ids(second));
  EXPECT_EQ(later.maps[0]->fingerprint, second.maps[0]->fingerprint);
  // Parts of the worlds, as other ranks have them.
  SceneSets rank(config(), training_world(config(), {}), {draw_training_worlds(config())[1]}, 2);
  EXPECT_THAT(ids(rank.take(2)), ElementsAre("1"));
}

TEST_F(SceneSetsTest, FoldersWithoutUsableScenesAreRefused) {
  EXPECT_THAT(test::message_of<Error>([&] { make_sets(config()); }), HasSubstr(folder_.path()));
  write(1, {}, /*has_drivers=*/false);
  SceneSets sets = make_sets(config());
  EXPECT_THAT(test::message_of<Error>([&] { sets.take(0); }), HasSubstr("expected a scene with road users to drive"));
}

TEST_F(SceneSetsTest, RunsTrainAndResumeExactlyAcrossSets) {
  for (int number = 1; number <= 3; ++number) write(number);
  const test::ScratchFolder runs;
  const auto policies = test::policies_of_equal_runs(runs.path(), "cpu",
                                                     {maps(), "simulator.num_slots=24", "simulator.max_agents=12",
                                                      "simulator.scenes.updates_per_set=1", "policy.modality=vector"});
  EXPECT_EQ(policies[0], policies[1]);
  EXPECT_EQ(policies[0], policies[2]);
  // The policy can be evaluated in the scenes.
  SceneEvaluateOptions options;
  options.checkpoint = runs / "whole/checkpoint.ckpt";
  options.device = "cpu";
  options.num_threads = 1;
  options.scenes = {folder_.path()};
  options.protocol = scene_protocol("gpudrive");
  EXPECT_EQ(evaluate_scenes(options).results.scored(), 3);
}

TEST_F(SceneSetsTest, PerspectivePoliciesTrainInSceneSets) {
  for (int number = 1; number <= 3; ++number) write(number);
  const test::ScratchFolder runs;
  const TrainReport report = train(test::small_run(runs / "a", "cpu",
                                                   {maps(), "simulator.num_slots=12", "simulator.max_agents=12",
                                                    "simulator.scenes.updates_per_set=1", "train.updates=2"}));
  EXPECT_EQ(report.updates, 2);
  EXPECT_GT(report.agent_steps, 0);
}

}  // namespace
}  // namespace pictura
