// The lane driver in every town: keeping one's lane and stopping at red lights causes no infraction, and reaches goals.
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/tests/simulator/lane_driver.h"

namespace pictura {
namespace {

/// Sixteen drivers for 60 s in every town. No event but the `harmless` ones may halt a driver, and those at most half
/// of them.
void drive_everywhere(float cyclist_fraction, int harmless) {
  std::vector<std::string> towns = known_towns();
  for (const char* town : {"procedural:1", "procedural:2"}) towns.emplace_back(town);
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    constexpr int kDrivers = 16, kSteps = 600;
    const auto map = load_map(town);
    int stops = 0, halted = 0, goals = 0;
    double distance_m = 0;
    for (const testing::DrivenEpisode& driven :
         testing::drive_lanes(map, {.num_threads = 1, .cyclist_fraction = cyclist_fraction}, kDrivers, kSteps)) {
      EXPECT_EQ(driven.halt_reason & ~harmless, 0) << "at " << driven.end_m.x << ' ' << driven.end_m.y;
      stops += driven.stops;
      halted += driven.halt_reason != 0;
      goals += driven.goals;
      distance_m += driven.distance_m;
    }
    EXPECT_LE(halted, kDrivers / 2);
    EXPECT_GT(goals, kDrivers / 2);
    EXPECT_GT(distance_m, kDrivers * 130);
    if (!map->lights.empty()) {
      EXPECT_GT(stops, 0) << "nobody ever waited at a red light";
    }
  }
}

TEST(Driver, OfABicycleKeepsItsLaneAndStopsAtRedLightsInEveryTown) { drive_everywhere(1, kEventNone); }

// The longest cars cannot take the tightest curves on their lane's centre line without touching the kerb.
TEST(Driver, OfACarStopsAtRedLightsInEveryTown) { drive_everywhere(0, kEventOffRoad); }

}  // namespace
}  // namespace pictura
