// Statistics of a map's roads, for comparisons of towns.
#pragma once

#include <array>

#include "pictura/map/map_fields.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Fractions at which MapStatistics takes quantiles.
inline constexpr std::array<double, 3> kMapQuantiles{0.05, 0.5, 0.95};
/// Radii of curves that separate the classes of MapStatistics::radius_shares.
inline constexpr std::array<double, 3> kMapRadii_m{20, 50, 200};
/// Minimum grade that counts as steep: 2 in 100.
inline constexpr double kSteepGrade = 0.02;

/// Statistics of a map. Shares and quantiles of driving lanes are weighted by length. They are 0 if the map has no such
/// lanes.
struct MapStatistics {
  // Quantiles at kMapQuantiles.
  std::array<double, 3> lane_width_m{}, speed_limit_mps{};
  // Outside junctions: shares of lanes where 1, 2, 3, or at least 4 lanes are side by side in their direction.
  std::array<double, 4> lanes_shares{};
  // Shares of lanes by the radius of their curves. Class i contains radii up to kMapRadii_m[i]; the last class contains
  // larger radii.
  std::array<double, 4> radius_shares{};
  // Share of lanes steeper than kSteepGrade; length of parking lanes divided by that of driving lanes outside
  // junctions.
  double steep_share = 0, parking_share = 0;
  // Numbers of junctions by number of roads: at most 3, exactly 4, exactly 5, and at least 6.
  std::array<int, 4> junctions_of_arms{};
  // Quantiles of the distance of a traffic light's head beyond the middle of its stop line.
  std::array<double, 3> head_ahead_m{};
};

PICTURA_FIELDS(MapStatistics, lane_width_m, speed_limit_mps, lanes_shares, radius_shares, steep_share, parking_share,
               junctions_of_arms, head_ahead_m)

MapStatistics map_statistics(const RoadMap& map);

}  // namespace pictura
