// Statistics of a map's roads that can be compared between towns.
#pragma once

#include <array>

#include "pictura/map/map_fields.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Fractions of the quantiles of MapStatistics.
inline constexpr std::array<double, 3> kMapQuantiles{0.05, 0.5, 0.95};
/// Radii that separate the classes of radius_shares.
inline constexpr std::array<double, 3> kMapRadii_m{20, 50, 200};
/// Minimum grade that counts as steep: 2 in 100.
inline constexpr double kSteepGrade = 0.02;

/// Statistics of a map. Shares and quantiles of driving lanes are weighted by length; they are 0 where nothing is
/// counted.
struct MapStatistics {
  std::array<double, 3> lane_width_m{}, speed_limit_mps{};
  std::array<double, 4> lanes_shares{};       // lanes in one direction outside junctions: 1, 2, 3, 4 or more
  std::array<double, 4> radius_shares{};      // radii up to the first of kMapRadii_m, ..., above the last
  double steep_share = 0, parking_share = 0;  // above kSteepGrade; parking lanes over driving lanes, by length
  std::array<int, 4> junctions_of_arms{};     // number of roads that meet: up to 3, 4, 5, 6 or more
  std::array<double, 3> head_ahead_m{};       // distances of lights beyond the middle of their stop lines
};

PICTURA_FIELDS(MapStatistics, lane_width_m, speed_limit_mps, lanes_shares, radius_shares, steep_share, parking_share,
               junctions_of_arms, head_ahead_m)

MapStatistics map_statistics(const RoadMap& map);

}  // namespace pictura
