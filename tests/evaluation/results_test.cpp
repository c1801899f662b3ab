// Results of an evaluation: ratios and their confidence intervals, files, and merging of parts.
#include "pictura/evaluation/results.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

ScenarioCounts counts(int64_t vehicles, int64_t at_fault, double distance_m) {
  ScenarioCounts c;
  c.vehicles = vehicles;
  c.collision = c.at_fault = c.any_infraction = c.at_fault_infraction = at_fault;
  c.distance_m = distance_m;
  return c;
}

EvaluationResults part(int first_scenario, std::vector<ScenarioCounts> scenarios) {
  EvaluationResults results;
  results.setting.policy_hash = "0123456789abcdef";
  results.setting.maps = {"procedural:1"};
  results.setting.steps = 100;
  results.densities.push_back({"light", 8, first_scenario, std::move(scenarios)});
  return results;
}

/// Returns a file of format 1, which counted only collisions at fault: `infractions` of 4 vehicles in 1 km.
std::string file_of_format_1(int first_scenario, int infractions) {
  test::ScratchFolder folder;
  const std::string path = folder / "empty.json";
  write_results(path, part(first_scenario, {}));
  std::string text = read_file(path);
  const auto replace = [&text](const std::string& old_text, const std::string& new_text) {
    text.replace(text.find(old_text), old_text.size(), new_text);
  };
  replace("pictura evaluation 2", "pictura evaluation 1");
  replace(R"("scenarios": [])",
          fmt::format(R"("scenarios": [{{"vehicles": 4, "at_fault": {}, "off_road": 0, "red_light": 0, )"
                      R"("infractions": {}, "active_at_end": 1, "goals": 2, "waypoints": 3, "distance_m": 1000.0, )"
                      R"("returns": 1.5}}])",
                      infractions, infractions));
  return text;
}

std::string merged_message(const EvaluationResults& a, const EvaluationResults& b) {
  return message_of([&] { merge({a, b}, {"a.json", "b.json"}); });
}

TEST(Results, RatesAreOverVehiclesAndIntervalsOverScenarios) {
  const EvaluateRow row = row_of(part(0, {counts(4, 1, 1000), counts(4, 3, 3000)}).densities[0], 100);
  EXPECT_EQ(row.scenarios, 2);
  EXPECT_EQ(row.vehicle_episodes, 8);
  EXPECT_DOUBLE_EQ(row.km_driven, 4);
  EXPECT_DOUBLE_EQ(row.at_fault_collision_rate.value, 0.5);
  // Equal sizes: the interval of the mean of .25 and .75, whose standard error is .25.
  EXPECT_DOUBLE_EQ(row.at_fault_collision_rate.half_width_95, 1.96 * 0.25);
  EXPECT_DOUBLE_EQ(row.km_per_infraction.value, 1);
  EXPECT_DOUBLE_EQ(row.km_per_infraction.half_width_95, 0);
  EXPECT_DOUBLE_EQ(row.off_road_rate.value, 0);
}

TEST(Results, DistancePerInfractionIsOverAnyCollision) {
  ScenarioCounts c = counts(10, 0, 12000);
  c.collision = 4;
  c.at_fault = 1;
  c.off_road = 2;
  c.wall_contact = 5;
  c.any_infraction = 6;
  c.at_fault_infraction = 3;
  const EvaluateRow row = row_of(part(0, {c, c}).densities[0], 100);
  EXPECT_DOUBLE_EQ(row.collision_rate.value, 0.4);
  EXPECT_DOUBLE_EQ(row.at_fault_collision_rate.value, 0.1);
  EXPECT_DOUBLE_EQ(row.wall_contact_rate.value, 0.5);
  EXPECT_DOUBLE_EQ(row.km_per_infraction.value, 2);
  EXPECT_DOUBLE_EQ(row.km_per_at_fault_infraction.value, 4);
}

TEST(Results, StandingIsOverTimeWaitsAndVehicles) {
  ScenarioCounts c = counts(10, 0, 12000);
  EXPECT_TRUE(std::isnan(row_of(part(0, {c, c}).densities[0], 100).reversing_share.value)) << "of an earlier version";
  c.standing.driven_steps = 1000;
  const EvaluateRow none = row_of(part(0, {c, c}).densities[0], 100);
  EXPECT_DOUBLE_EQ(none.reversing_share.value, 0);
  EXPECT_TRUE(std::isnan(none.red_wait_moved_m.value)) << "nobody waited";
  ScenarioCounts other = c;
  c.standing.reversing_steps = 50;
  c.standing.red_waits = 3;
  c.standing.red_wait_moved_m = 1.5;
  c.standing.stuck_at_end = 2;
  other.standing.red_waits = 1;
  const EvaluateRow row = row_of(part(0, {c, other}).densities[0], 100);
  EXPECT_DOUBLE_EQ(row.reversing_share.value, 0.025);
  EXPECT_EQ(row.red_waits, 4);
  EXPECT_DOUBLE_EQ(row.red_wait_moved_m.value, 0.375);
  EXPECT_DOUBLE_EQ(row.stuck_at_end_share.value, 0.1);
}

TEST(Results, FilesOfFormat1LackLaterCounts) {
  test::ScratchFolder folder;
  const std::string old_path = folder / "old.json", next_path = folder / "next.json", again = folder / "again.json";
  write_file(old_path, file_of_format_1(0, 2));
  write_file(next_path, file_of_format_1(1, 0));
  const EvaluationResults old = read_results(old_path);
  EXPECT_FALSE(old.counts_all_collisions);
  const EvaluateRow row = rows_of(old)[0];
  EXPECT_TRUE(std::isnan(row.km_per_infraction.value));
  EXPECT_TRUE(std::isnan(row.collision_rate.value));
  EXPECT_TRUE(std::isnan(row.wall_contact_rate.value));
  EXPECT_TRUE(std::isnan(row.never_moved_share.value));
  EXPECT_FALSE(row.counts_infractions());
  EXPECT_DOUBLE_EQ(row.km_per_at_fault_infraction.value, 0.5);
  EXPECT_DOUBLE_EQ(row.at_fault_collision_rate.value, 0.5);
  // A part that counts everything does not extend the counts of the whole, which has the other part's format.
  for (const EvaluationResults& rest : {read_results(next_path), part(1, {counts(4, 0, 1000)})}) {
    const EvaluationResults whole = merge({old, rest}, {"old.json", "rest.json"});
    EXPECT_FALSE(whole.counts_all_collisions);
    EXPECT_DOUBLE_EQ(rows_of(whole)[0].km_per_at_fault_infraction.value, 1);
    write_results(again, whole);
    EXPECT_THAT(read_file(again), AllOf(HasSubstr("pictura evaluation 1"), HasSubstr("\"infractions\": 2"),
                                        Not(HasSubstr("any_infraction"))));
    EXPECT_DOUBLE_EQ(rows_of(read_results(again))[0].km_per_at_fault_infraction.value, 1);
  }
  EXPECT_TRUE(rows_of(part(0, {counts(4, 1, 1000)}))[0].km_per_infraction.value == 1);
}

TEST(Results, UndefinedIntervalsAndDistancesAreInfinite) {
  const EvaluateRow one = row_of(part(0, {counts(4, 1, 1000)}).densities[0], 100);
  EXPECT_DOUBLE_EQ(one.at_fault_collision_rate.value, 0.25);
  EXPECT_TRUE(std::isinf(one.at_fault_collision_rate.half_width_95));
  const EvaluateRow clean = row_of(part(0, {counts(4, 0, 1000), counts(4, 0, 1)}).densities[0], 100);
  EXPECT_TRUE(std::isinf(clean.km_per_infraction.value));
}

TEST(Results, PartsMergeInAnyOrder) {
  const EvaluationResults whole = part(3, {counts(4, 1, 10.25), counts(5, 2, 0.1), counts(6, 0, 1e9 / 3)});
  const EvaluationResults first = part(3, {whole.densities[0].scenarios[0]});
  const EvaluationResults rest = part(4, {whole.densities[0].scenarios[1], whole.densities[0].scenarios[2]});
  test::ScratchFolder folder;
  const std::string whole_path = folder / "whole.json", merged_path = folder / "merged.json";
  write_results(whole_path, whole);
  write_results(folder / "first.json", first);
  write_results(folder / "rest.json", rest);
  write_results(merged_path,
                merge({read_results(folder / "rest.json"), read_results(folder / "first.json")}, {"rest", "first"}));
  EXPECT_EQ(read_file(merged_path), read_file(whole_path));
}

TEST(Results, ErrorsNameTheDifferenceOfIncompatibleParts) {
  const EvaluationResults first = part(0, {counts(4, 1, 10), counts(4, 1, 10)});
  EXPECT_THAT(merged_message(first, part(1, {counts(4, 1, 10)})),
              AllOf(HasSubstr("b.json: light: begins with scenario 1: expected 2"), HasSubstr("a.json")));
  EXPECT_THAT(merged_message(first, part(3, {counts(4, 1, 10)})), HasSubstr("begins with scenario 3: expected 2"));
  EvaluationResults other = part(2, {counts(4, 1, 10)});
  other.setting.steps = 99;
  EXPECT_THAT(merged_message(first, other), HasSubstr("b.json: steps is 99, in a.json 100"));
  EvaluationResults bold = part(2, {counts(4, 1, 10)});
  bold.setting.conditioning[static_cast<size_t>(Conditioning::collision)] = 0.5;
  EXPECT_THAT(merged_message(first, bold), HasSubstr("b.json: conditioning.collision is 0.5, in a.json 0.0"));
  EvaluationResults lit = part(2, {counts(4, 1, 10)});
  lit.setting.light_cycles = LightCycles::independent;
  EXPECT_THAT(merged_message(first, lit), HasSubstr("b.json: light_cycles is \"independent\", in a.json \"phases\""));
  EvaluationResults moved = part(2, {counts(4, 1, 10)});
  moved.setting.light_heads = "visible";
  EXPECT_THAT(merged_message(first, moved), HasSubstr("b.json: light_heads is \"visible\", in a.json \"as_mapped\""));
  EvaluationResults rebuilt = part(2, {counts(4, 1, 10)});
  rebuilt.setting.maps_hash = "fedcba9876543210";
  EXPECT_THAT(merged_message(first, rebuilt), HasSubstr("b.json: maps_hash is \"fedcba9876543210\", in a.json \"\""));
  EvaluationResults populated = part(2, {counts(4, 1, 10)});
  populated.setting.config["simulator.cyclist_fraction"] = "0.2";
  EXPECT_THAT(merged_message(first, populated),
              HasSubstr("b.json: config.simulator.cyclist_fraction is \"0.2\", in a.json null"));
  EXPECT_THAT(merged_message(populated, first), HasSubstr("config.simulator.cyclist_fraction is null"));
  EvaluationResults crowd = part(2, {counts(4, 1, 10)});
  crowd.densities[0].agents_per_world = 9;
  EXPECT_THAT(merged_message(first, crowd), HasSubstr("has 9 agents per world, a.json has 8"));
  EXPECT_THAT(message_of([] { merge({}, {}); }), HasSubstr("one part or more"));
}

TEST(Results, FilesHoldLightCyclesAndOldFilesHavePhases) {
  test::ScratchFolder folder;
  const std::string path = folder / "x.json";
  EvaluationResults results = part(0, {counts(4, 1, 10)});
  results.setting.light_cycles = LightCycles::independent;
  write_results(path, results);
  EXPECT_EQ(read_results(path).setting.light_cycles, LightCycles::independent);
  const std::string text = read_file(path), key = "\"light_cycles\": \"independent\"";
  const size_t at = text.find(key);
  ASSERT_NE(at, std::string::npos) << text;
  const auto with = [&](const std::string& other) { return std::string(text).replace(at, key.size(), other); };
  write_file(path, with("\"version_of_before\": 0"));
  EXPECT_EQ(read_results(path).setting.light_cycles, LightCycles::phases);
  write_file(path, with("\"light_cycles\": \"alone\""));
  EXPECT_THAT(message_of([&] { read_results(path); }),
              AllOf(HasSubstr("x.json"), HasSubstr("expected phases, independent, got 'alone'")));
}

TEST(Results, FilesWithoutLightHeadPlacementAreRead) {
  test::ScratchFolder folder;
  const std::string path = folder / "x.json";
  EvaluationResults moved = part(0, {counts(4, 1, 10)});
  moved.setting.light_heads = "visible";
  write_results(path, moved);
  EXPECT_EQ(read_results(path).setting.light_heads, "visible");
  Json json = Json::parse(read_file(path));
  ASSERT_EQ(json.at("setting").erase("light_heads"), 1u);
  write_file(path, json.dump());
  EXPECT_EQ(read_results(path).setting.light_heads, "as_mapped");
}

TEST(Results, ErrorsNameForeignFiles) {
  test::ScratchFolder folder;
  const std::string path = folder / "x.json";
  for (const char* text :
       {"", "[1]", "{}", R"({"format": "pictura evaluation 1"})", R"({"format": "pictura evaluation 3"})",
        R"({"format": "pictura evaluation 2", "densities": 1e999})"}) {
    write_file(path, text);
    EXPECT_THAT(message_of([&] { read_results(path); }), AllOf(HasSubstr("x.json"), HasSubstr("evaluate --out")))
        << text;
  }
}

}  // namespace
}  // namespace pictura
