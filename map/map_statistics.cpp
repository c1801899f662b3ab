#include "pictura/map/map_statistics.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

namespace pictura {

namespace {

/// Distribution of values with weights.
class Distribution {
 public:
  void add(double value, double weight) {
    values_.emplace_back(value, weight);
    total_ += weight;
  }

  std::array<double, 3> quantiles() {
    std::array<double, 3> found{};
    std::sort(values_.begin(), values_.end());
    double below = 0;
    std::size_t next = 0;
    for (const auto& [value, weight] : values_) {
      below += weight;
      while (next < found.size() && below >= kMapQuantiles[next] * total_) found[next++] = value;
    }
    return found;
  }

 private:
  std::vector<std::pair<double, double>> values_;
  double total_ = 0;
};

template <std::size_t N>
void divide(std::array<double, N>* shares, double total) {
  for (double& share : *shares) share = total > 0 ? share / total : 0;
}

/// Returns the number of driving lanes side by side in the direction of a lane, including the lane.
int lanes_abreast(const RoadMap& map, const Lane& lane) {
  int count = 1;
  for (int32_t Lane::* side : {&Lane::left_neighbor, &Lane::right_neighbor}) {
    for (int32_t next = lane.*side; next >= 0; next = map.lanes[next].*side) {
      count += map.lanes[next].type == LaneType::driving ? 1 : 0;
    }
  }
  return count;
}

void add_lanes(const RoadMap& map, MapStatistics* statistics) {
  Distribution widths, limits;
  double length_m = 0, outside_m = 0, steep_m = 0, parking_m = 0;
  for (const Lane& lane : map.lanes) {
    const auto lane_m = static_cast<double>(lane.length_m);
    if (lane.type == LaneType::parking) parking_m += lane_m;
    if (lane.type != LaneType::driving) continue;
    limits.add(static_cast<double>(lane.speed_limit_mps), lane_m);
    if (!lane.in_junction) {
      outside_m += lane_m;
      statistics->lanes_shares[static_cast<std::size_t>(std::min(lanes_abreast(map, lane), 4) - 1)] += lane_m;
    }
    const Span<const LanePoint> points = map.points_of(lane);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const LanePoint &a = points[i - 1], &b = points[i];
      const auto piece_m = static_cast<double>(b.s_m - a.s_m);
      if (piece_m <= 0) continue;
      const auto turn = static_cast<double>(std::abs(wrap_angle(b.heading_rad - a.heading_rad)));
      const auto climb_m = static_cast<double>(std::abs(b.position_m.z - a.position_m.z));
      std::size_t radius_class = 0;
      while (radius_class < kMapRadii_m.size() && turn * kMapRadii_m[radius_class] < piece_m) ++radius_class;
      length_m += piece_m;
      statistics->radius_shares[radius_class] += piece_m;
      steep_m += climb_m > kSteepGrade * piece_m ? piece_m : 0;
      widths.add(0.5 * static_cast<double>(a.width_m + b.width_m), piece_m);
    }
  }
  divide(&statistics->lanes_shares, outside_m);
  divide(&statistics->radius_shares, length_m);
  statistics->lane_width_m = widths.quantiles();
  statistics->speed_limit_mps = limits.quantiles();
  statistics->steep_share = length_m > 0 ? steep_m / length_m : 0;
  statistics->parking_share = outside_m > 0 ? parking_m / outside_m : 0;
}

void add_arms(const RoadMap& map, MapStatistics* statistics) {
  std::vector<std::set<int32_t>> arms(map.junctions.size());
  for (const Lane& lane : map.lanes) {
    if (lane.junction < 0 || lane.type != LaneType::driving) continue;
    for (const IndexRange links : {lane.predecessors, lane.successors}) {
      for (const int32_t other : map.links(links)) {
        if (map.lanes[other].junction != lane.junction) arms[lane.junction].insert(map.lanes[other].source_road);
      }
    }
  }
  for (const std::set<int32_t>& roads : arms) {
    if (roads.empty()) continue;
    ++statistics->junctions_of_arms[std::clamp<std::size_t>(roads.size(), 3, 6) - 3];
  }
}

}  // namespace

MapStatistics map_statistics(const RoadMap& map) {
  MapStatistics statistics;
  add_lanes(map, &statistics);
  add_arms(map, &statistics);
  Distribution heads;
  for (const TrafficLight& light : map.lights) {
    const Vec2 middle = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
    const Vec2 forward{std::cos(light.stop_heading_rad), std::sin(light.stop_heading_rad)};
    heads.add(static_cast<double>(dot(light.head_m.xy() - middle, forward)), 1);
  }
  statistics.head_ahead_m = heads.quantiles();
  return statistics;
}

}  // namespace pictura
