// Mixed traffic: the driver of each vehicle, and the counts in each driver's row of the results.
#include "pictura/evaluation/mixed_traffic.h"

#include <algorithm>

#include <gmock/gmock.h>

#include "pictura/evaluation/evaluate.h"
#include "pictura/tests/evaluation/probed_policies.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

EvaluateOptions small_worlds() {
  EvaluateOptions options;
  options.maps = {"procedural:1", "procedural:2"};
  options.agents_per_world = 60;
  options.first_scenario = 3;
  options.scenarios = 4;
  options.steps = 60;
  options.num_threads = 1;
  options.device = options.simulator = "cpu";
  return options;
}

EvaluateReport evaluate_controller(const std::string& name, std::vector<std::string> others) {
  EvaluateOptions options = small_worlds();
  options.controller = name;
  options.others = std::move(others);
  return evaluate(options);
}

EvaluateReport evaluate_policy(const std::string& path, std::vector<std::string> others) {
  EvaluateOptions options = small_worlds();
  options.checkpoint = path;
  options.others = std::move(others);
  return evaluate(options);
}

// Sums over all drivers and scenarios.
ScenarioCounts sum(const EvaluateReport& report) {
  ScenarioCounts all;
  for (const DensityResult& result : report.results.densities) {
    for (const ScenarioCounts& counts : result.scenarios) {
      std::vector<double> values;
      ScenarioCounts::visit(counts, [&values](const char*, auto count) { values.push_back(double(count)); });
      size_t next = 0;
      ScenarioCounts::visit(all, [&](const char*, auto& total) {
        total += static_cast<std::remove_reference_t<decltype(total)>>(values[next++]);
      });
    }
  }
  return all;
}

void expect_equal(const ScenarioCounts& a, const ScenarioCounts& b) {
  std::vector<double> expected;
  ScenarioCounts::visit(b, [&expected](const char*, auto count) { expected.push_back(double(count)); });
  size_t next = 0;
  ScenarioCounts::visit(a, [&](const char* name, auto count) {
    const double value = expected[next++];
    EXPECT_NEAR(double(count), value, 1e-9 * std::abs(value)) << name;
  });
}

TEST(MixedTraffic, IsReadFromTexts) {
  const std::vector<OtherDriver> others = other_drivers({"lane=0.25", "a=b/run.ckpt=.5"});
  ASSERT_EQ(others.size(), 2u);
  EXPECT_EQ(others[0].name, "lane");
  EXPECT_EQ(others[0].share, 0.25);
  EXPECT_EQ(others[1].name, "a=b/run.ckpt") << "a path may hold the sign";
  EXPECT_EQ(others[1].share, 0.5);
  const auto refused = [](const std::vector<std::string>& texts) {
    return test::message_of<UsageError>([&] { other_drivers(texts); });
  };
  for (const char* text : {"lane", "=0.5", "lane=", "lane=0", "lane=-1", "lane=nan", "lane=half"}) {
    EXPECT_THAT(refused({text}), HasSubstr("for instance lane=0.25; got '" + std::string(text) + "'"));
  }
  EXPECT_THAT(refused({"lane=0.5", "idle=0.5"}), HasSubstr("expected shares that sum to less than 1"));
  EXPECT_THAT(refused(std::vector<std::string>(9, "lane=0.1")), HasSubstr("expected at most 8, got 9"));
}

TEST(MixedTraffic, CountsEachVehicleOnceForOneController) {
  const EvaluateReport alone = evaluate_controller("idm_lanes", {}),
                       mixed = evaluate_controller("idm_lanes", {"idm_lanes=0.3", "idm_lanes=0.4"});
  ASSERT_EQ(alone.rows.size(), 1u);
  ASSERT_EQ(mixed.rows.size(), 3u);
  EXPECT_EQ(mixed.rows[0].driver, "");
  EXPECT_EQ(mixed.rows[1].driver, "idm_lanes");
  EXPECT_THAT(mixed.results.setting.others, ElementsAre("idm_lanes=0.3", "idm_lanes=0.4"));
  expect_equal(sum(mixed), sum(alone));
  EXPECT_EQ(mixed.agent_steps, alone.agent_steps);
  const auto vehicles = double(alone.rows[0].vehicle_episodes);
  EXPECT_NEAR(double(mixed.rows[0].vehicle_episodes) / vehicles, 0.3, 0.1);
  EXPECT_NEAR(double(mixed.rows[1].vehicle_episodes) / vehicles, 0.3, 0.1);
  EXPECT_NEAR(double(mixed.rows[2].vehicle_episodes) / vehicles, 0.4, 0.1);
  EXPECT_EQ(mixed.rows[1].asked, mixed.rows[1].vehicle_episodes) << "pedestrians and cyclists are number 0's";
}

TEST(MixedTraffic, HasOneRowPerDriver) {
  const EvaluateReport report = evaluate_controller("random", {"lane=0.5"});
  EXPECT_EQ(report.rows[1].off_road_rate.value, 0);
  EXPECT_GT(report.rows[1].km_per_vehicle.value, 0);
  EXPECT_GT(report.rows[0].off_road_rate.value, 0);
}

TEST(MixedTraffic, PartsMergeIntoTheWhole) {
  const test::ScratchFolder folder;
  const EvaluateReport whole = evaluate_controller("lane", {"idle=0.5"});
  EvaluateOptions options = small_worlds();
  options.controller = "lane";
  options.others = {"idle=0.5"};
  options.scenarios = 2;
  write_results(folder / "a.json", evaluate(options).results);
  options.first_scenario += 2;
  write_results(folder / "b.json", evaluate(options).results);
  const EvaluationResults merged =
      merge({read_results(folder / "a.json"), read_results(folder / "b.json")}, {"a", "b"});
  const std::vector<EvaluateRow> rows = rows_of(merged);
  ASSERT_EQ(rows.size(), 2u);
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].driver, whole.rows[i].driver);
    EXPECT_EQ(rows[i].km_driven, whole.rows[i].km_driven);
    EXPECT_EQ(rows[i].reversing_share.value, whole.rows[i].reversing_share.value);
  }
  EXPECT_THAT(test::message_of<Error>([&] {
                merge({read_results(folder / "a.json"), evaluate_controller("lane", {}).results}, {"a", "c"});
              }),
              HasSubstr("others"));
}

TEST(MixedTraffic, CountsImpairedAgentsSeparately) {
  const EvaluateReport report = evaluate_controller("lane", {"phantom_braking=0.4", "idle=0.3"});
  ASSERT_EQ(report.rows.size(), 3u);
  EXPECT_EQ(report.rows[1].driver, "phantom_braking");
  EXPECT_THAT(report.results.setting.others, ElementsAre("phantom_braking=0.4", "idle=0.3"));
  const EvaluateReport plain = evaluate_controller("lane", {});
  const auto agents = double(plain.rows[0].asked);
  EXPECT_EQ(report.rows[0].asked + report.rows[1].asked + report.rows[2].asked, plain.rows[0].asked);
  EXPECT_NEAR(double(report.rows[1].asked) / agents, 0.4, 0.1) << "of any class";
  EXPECT_GT(report.rows[1].asked, report.rows[1].vehicle_episodes);
  EXPECT_NEAR(double(report.rows[2].vehicle_episodes) / double(plain.rows[0].vehicle_episodes), 0.3, 0.08)
      << "of all vehicles, not of those that are not impaired";
  EXPECT_LT(report.rows[1].km_per_vehicle.value, plain.rows[0].km_per_vehicle.value);
  EXPECT_EQ(evaluate_controller("lane", {"phantom_braking=0.4", "idle=0.3"}).rows[1].km_driven,
            report.rows[1].km_driven);
}

TEST(MixedTraffic, RefusesImpairmentsWithoutEffect) {
  EXPECT_THAT(test::message_of<UsageError>([] { evaluate_controller("lane", {"blind=0.1"}); }),
              HasSubstr("others: blind: has no effect on the controller lane"));
  EXPECT_EQ(test::message_of<UsageError>([] { other_drivers({"blind=0.1", "blind=0.2"}); }),
            "others: blind is given twice");
}

class MixedPolicies : public test::ProbedPolicies {};

TEST_F(MixedPolicies, AllKindsDriveTogether) {
  const EvaluateReport report = evaluate_policy(
      policies_[test::kAgent], {policies_[test::kVectorized] + "=0.25", policies_[test::kLikeForLike] + "=0.25"});
  ASSERT_EQ(report.rows.size(), 3u);
  for (const EvaluateRow& row : report.rows) EXPECT_GT(row.vehicle_episodes, 0) << row.driver;
}

TEST_F(MixedPolicies, DriveWhileImpaired) {
  for (const size_t policy : {test::kAgent, test::kVectorized}) {
    const EvaluateReport report =
        evaluate_policy(policies_[policy], {"blind=0.3", policies_[test::kLikeForLike] + "=0.2", "inattentive=0.2"});
    ASSERT_EQ(report.rows.size(), 4u);
    for (const EvaluateRow& row : report.rows) {
      EXPECT_GT(row.vehicle_episodes, 0) << row.driver;
      EXPECT_LT(row.never_moved_share.value, 1) << row.driver;
    }
  }
}

TEST_F(MixedPolicies, PoliciesWithoutAuxiliarySlotsReadZeros) {
  // Share that selects no vehicle.
  const EvaluateReport alone = evaluate_policy(policies_[test::kLikeForLike], {}),
                       beside =
                           evaluate_policy(policies_[test::kLikeForLike], {policies_[test::kVectorized] + "=1e-9"});
  ASSERT_EQ(beside.rows[1].vehicle_episodes, 0);
  ASSERT_GT(alone.rows[0].km_driven, 0);
  expect_equal(sum(beside), sum(alone));
}

}  // namespace
}  // namespace pictura
