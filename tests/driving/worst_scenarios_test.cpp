// Order in which the worst scenarios of an evaluation are recorded again.
#include <gmock/gmock.h>

#include "pictura/driving/replay_scenarios.h"

namespace pictura {
namespace {

ScenarioCounts counts(int64_t infractions, int64_t at_fault, double distance_m) {
  ScenarioCounts result;
  result.vehicles = 10;
  result.at_fault_infraction = infractions;
  result.at_fault = at_fault;
  result.distance_m = distance_m;
  return result;
}

TEST(WorstScenarios, AreOrderedByInfractionsThenFaultThenDistance) {
  EvaluationResults results;
  results.densities.push_back({"light", 10, 5, {counts(2, 1, 900), counts(2, 2, 900), counts(3, 0, 900)}});
  results.densities.push_back({"dense", 10, 5, {counts(2, 1, 400), counts(0, 0, 0)}});
  std::vector<std::pair<size_t, int>> order;
  for (const ScenarioPlace& place : worst_scenarios(results, 10)) order.emplace_back(place.density, place.scenario);
  EXPECT_THAT(order, ::testing::ElementsAre(std::pair(0u, 7), std::pair(0u, 6), std::pair(1u, 5), std::pair(0u, 5),
                                            std::pair(1u, 6)));
  EXPECT_EQ(worst_scenarios(results, 2).size(), 2u);
}

}  // namespace
}  // namespace pictura
