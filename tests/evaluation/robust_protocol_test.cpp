// The robust protocol: which conditions apply to a driver, and whether each condition is the evaluation that it names.
#include "pictura/evaluation/robust_protocol.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include <gmock/gmock.h>

#include "pictura/evaluation/results.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

RobustOptions lane_keeper() {
  RobustOptions options;
  options.controller = "lane";
  options.scenarios = 1;
  options.num_threads = 1;
  options.device = options.simulator = "cpu";
  return options;
}

const RobustRow& row_named(const RobustReport& report, const std::string& name) {
  for (const RobustRow& row : report.rows) {
    if (row.condition.name == name) return row;
  }
  throw std::runtime_error("no row " + name);
}

TEST(RobustProtocol, FirstConditionIsPlainAndNamesAreUnique) {
  const std::vector<RobustCondition>& conditions = robust_conditions();
  EXPECT_THAT(conditions.front().others, IsEmpty());
  EXPECT_EQ(conditions.front().camera_severity, 0);
  std::set<std::string> names;
  for (const RobustCondition& condition : conditions) names.insert(condition.name);
  EXPECT_EQ(names.size(), conditions.size());
}

TEST(RobustProtocol, DrivesAControllerUnderApplicableConditions) {
  RobustOptions of_lane_keeper = lane_keeper();
  std::vector<double> fractions;
  of_lane_keeper.on_progress = [&fractions](double done, double) { fractions.push_back(done); };
  const RobustReport report = evaluate_robust(of_lane_keeper);
  ASSERT_EQ(report.rows.size(), robust_conditions().size());
  EXPECT_EQ(row_named(report, "impaired").not_driven, "reads no observations");
  EXPECT_EQ(row_named(report, "severity 1").not_driven, "sees no images");
  EXPECT_THAT(row_named(report, "severity 1").counts.scenarios, IsEmpty());
  EXPECT_FALSE(report.interrupted);
  EXPECT_EQ(report.setting.light_heads, "visible");
  ASSERT_GT(fractions.size(), 5u);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_LT(fractions.front(), 0.2);
  EXPECT_EQ(fractions.back(), 1);

  // The row of others is that of a plain evaluation with the protocol's numbers.
  EvaluateOptions options;
  static_cast<DriverOptions&>(options) = lane_keeper();
  const RobustRow& among_idm = row_named(report, "idm_lanes");
  options.maps = among_idm.condition.maps;
  options.agents_per_world = among_idm.condition.agents_per_world;
  options.others = among_idm.condition.others;
  options.scenarios = 1;
  options.steps = kRobustSteps;
  options.light_cycles = LightCycles::independent;
  const EvaluateReport plain = evaluate(options);
  const EvaluateRow robust = report.metrics(among_idm);
  EXPECT_EQ(robust.vehicle_episodes, plain.rows.front().vehicle_episodes);
  EXPECT_GT(plain.rows.at(1).vehicle_episodes, 0) << "others drive too";
  EXPECT_EQ(robust.km_driven, plain.rows.front().km_driven);
  EXPECT_EQ(robust.goals_per_vehicle.value, plain.rows.front().goals_per_vehicle.value);

  const auto pooled = report.pooled();
  ASSERT_EQ(pooled.size(), 3u) << "no cameras";
  EXPECT_EQ(pooled.at(0).first, "towns");
  EXPECT_EQ(pooled.at(2).first, "all");
  const EvaluateRow towns = pooled.at(0).second;
  const EvaluateRow grid = report.metrics(row_named(report, "grid towns"));
  const EvaluateRow cities = report.metrics(row_named(report, "cities"));
  EXPECT_EQ(towns.vehicle_episodes, grid.vehicle_episodes + cities.vehicle_episodes);
  EXPECT_DOUBLE_EQ(towns.km_driven, grid.km_driven + cities.km_driven);
  EXPECT_GT(pooled.at(2).second.vehicle_episodes, towns.vehicle_episodes);
  EXPECT_EQ(report.setting.steps, kRobustSteps);
}

TEST(RobustProtocol, CountsEqualWorldsOfSeveralConditionsOnce) {
  RobustRow one{{"others", "first", {"procedural:1"}, 40, {}, 0}, {}, {}};
  for (const int at_fault : {1, 3, 0}) {
    ScenarioCounts& counts = one.counts.scenarios.emplace_back();
    counts.vehicles = 10;
    counts.at_fault = at_fault;
  }
  RobustReport report;
  report.rows = {one, one};
  const EvaluateRow pooled = report.pooled().front().second, alone = report.metrics(one);
  EXPECT_EQ(pooled.scenarios, 6);
  EXPECT_EQ(pooled.vehicle_episodes, 60);
  EXPECT_EQ(pooled.at_fault_collision_rate.value, alone.at_fault_collision_rate.value);
  EXPECT_DOUBLE_EQ(pooled.at_fault_collision_rate.half_width_95, alone.at_fault_collision_rate.half_width_95)
      << "a second condition in the same worlds says nothing about other worlds";

  report.rows[1].condition.maps = {"procedural:2"};
  EXPECT_LT(report.pooled().front().second.at_fault_collision_rate.half_width_95,
            alone.at_fault_collision_rate.half_width_95);
}

TEST(RobustProtocol, RefusesOptionsThatItFixes) {
  RobustOptions options = lane_keeper();
  options.seed = 2;
  EXPECT_THAT(test::message_of<UsageError>([&options] { evaluate_robust(options); }), HasSubstr("seed: has no effect"));
  options = lane_keeper();
  options.light_cycles = LightCycles::phases;
  EXPECT_THAT(test::message_of<UsageError>([&options] { evaluate_robust(options); }), HasSubstr("light_cycles"));
}

}  // namespace
}  // namespace pictura
