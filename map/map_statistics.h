// Statistics of a map's roads, for comparisons of towns.
#pragma once

#include <array>

#include "pictura/map/map_fields.h"
#include "pictura/map/road_map.h"

namespace pictura {

inline constexpr std::array<double, 3> kMapQuantiles{0.05, 0.5, 0.95};
/// Limits of the classes of MapStatistics::radius_shares.
inline constexpr std::array<double, 3> kMapRadii_m{20, 50, 200};
/// Minimum grade that counts as steep.
inline constexpr double kSteepGrade = 0.02;

/// Statistics of driving lanes are weighted by length, and 0 without such lanes.
struct MapStatistics {
  // Quantiles at kMapQuantiles.
  std::array<double, 3> lane_width_m{}, speed_limit_mps{};
  // Shares of lanes outside junctions, by the number of lanes in their direction: 1, 2, 3, or more.
  std::array<double, 4> lanes_shares{};
  // Shares by radius. Class i contains radii up to kMapRadii_m[i]; the last class contains larger radii.
  std::array<double, 4> radius_shares{};
  // `steep_share` is the share of driving lanes steeper than kSteepGrade. `parking_share` is the length of parking
  // lanes divided by that of driving lanes outside junctions.
  double steep_share = 0, parking_share = 0;
  // Numbers of junctions by their number of roads: 1 to 3; 4; 5; more.
  std::array<int, 4> junctions_of_arms{};
  // Quantiles of the distances of light heads beyond their stop lines.
  std::array<double, 3> head_ahead_m{};
};

PICTURA_FIELDS(MapStatistics, lane_width_m, speed_limit_mps, lanes_shares, radius_shares, steep_share, parking_share,
               junctions_of_arms, head_ahead_m)

MapStatistics map_statistics(const RoadMap& map);

}  // namespace pictura
