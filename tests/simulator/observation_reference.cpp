#include "pictura/tests/simulator/observation_reference.h"

#include <algorithm>
#include <cmath>

namespace pictura::testing {
namespace {

constexpr double kSpeed_mps = 20, kAcceleration_mps2 = 5, kLateralAcceleration_mps2 = 4, kSteering_rad = 0.55;
constexpr double kLength_m = 6, kWidth_m = 3, kLaneOffset_m = 4, kNoLane_m = 4, kNoLaneLimit_mps = 15;
constexpr double kDistance_m = 120, kMapHeight_m = 10, kHalfLength_m = 5;
constexpr double kRange_m = 100, kBehind_m = 20, kAhead_m = 120, kAside_m = 30;
constexpr float kCell_m = 10, kLaneReach_m = 15;

/// The ego frame. Its origin is the reference point; x forward, y left, z up.
struct Frame {
  double x_m, y_m, z_m, cosine, sine;

  double forward(double x, double y) const { return x * cosine + y * sine; }
  double left(double x, double y) const { return y * cosine - x * sine; }
  /// Returns the scaled coordinates of a point.
  std::vector<double> point(const Vec3& at) const {
    const double x = at.x - x_m, y = at.y - y_m;
    return {forward(x, y) / kDistance_m, left(x, y) / kDistance_m, (at.z - z_m) / kMapHeight_m};
  }
};

ReferenceRow partner(const Frame& ego, const AgentBox& box, double speed_mps) {
  ReferenceRow row;
  row.distance_m = std::hypot(box.center_m.x - ego.x_m, box.center_m.y - ego.y_m);
  row.inside_m = kRange_m - row.distance_m;
  row.features = ego.point(box.center_m);
  row.features.insert(row.features.end(),
                      {box.length_m / kLength_m, box.width_m / kWidth_m, ego.forward(box.cos_heading, box.sin_heading),
                       ego.left(box.cos_heading, box.sin_heading), speed_mps / kSpeed_mps});
  return row;
}

ReferenceRow control(const Frame& ego, const TrafficLight& light, LightState state, bool controls_ego) {
  const Vec3 &a = light.stop_a_m, &b = light.stop_b_m;
  ReferenceRow row;
  row.distance_m = std::hypot((a.x + b.x) / 2.0 - ego.x_m, (a.y + b.y) / 2.0 - ego.y_m);
  row.inside_m = kRange_m - row.distance_m;
  const std::vector<double> left_end = ego.point(a), right_end = ego.point(b);
  row.features = {left_end[0], left_end[1], right_end[0], right_end[1], (left_end[2] + right_end[2]) / 2};
  row.features.push_back(state == LightState::red      ? 1
                         : state == LightState::yellow ? 0.5
                         : state == LightState::green  ? -1
                                                       : 0);
  row.features.push_back(controls_ego ? 1 : 0);
  return row;
}

/// Calls visit(box) with the box around each piece of a drivable lane, enlarged by 15 m on all sides.
template <typename Visit>
void visit_lane_surroundings(const RoadMap& map, const Visit& visit) {
  for (const Lane& lane : map.lanes) {
    const Span<const LanePoint> points = map.points_of(lane);
    for (size_t i = 1; is_drivable(lane.type) && i < points.size(); ++i) {
      const Vec3 &a = points[i - 1].position_m, &b = points[i].position_m;
      visit(Aabb2{{std::min(a.x, b.x) - kLaneReach_m, std::min(a.y, b.y) - kLaneReach_m},
                  {std::max(a.x, b.x) + kLaneReach_m, std::max(a.y, b.y) + kLaneReach_m}});
    }
  }
}

/// The 10 m cell of the ego. Cells fill the box around all surroundings of lanes, counted from its low corner; an ego
/// beyond the cells has the nearest cell.
struct Cell {
  Vec2 center_m;
  bool is_near_lane = false;  // whether the cell reaches the surroundings of a lane
  bool holds_ego = false;
};

Cell cell_of(const RoadMap& map, const Frame& ego) {
  Aabb2 all{{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
  visit_lane_surroundings(map, [&all](const Aabb2& box) {
    all.low = {std::min(all.low.x, box.low.x), std::min(all.low.y, box.low.y)};
    all.high = {std::max(all.high.x, box.high.x), std::max(all.high.y, box.high.y)};
  });
  const auto number = [](double low_m, double at_m) { return std::floor((at_m - low_m) / kCell_m); };
  const double own_x = number(all.low.x, ego.x_m), own_y = number(all.low.y, ego.y_m);
  const double x = std::clamp(own_x, 0.0, number(all.low.x, all.high.x));
  const double y = std::clamp(own_y, 0.0, number(all.low.y, all.high.y));
  const Vec2 low{all.low.x + static_cast<float>(x) * kCell_m, all.low.y + static_cast<float>(y) * kCell_m};
  Cell cell{{low.x + kCell_m / 2, low.y + kCell_m / 2}, false, x == own_x && y == own_y};
  visit_lane_surroundings(map, [&](const Aabb2& box) {
    cell.is_near_lane = cell.is_near_lane || (box.low.x <= low.x + kCell_m && box.high.x >= low.x &&
                                              box.low.y <= low.y + kCell_m && box.high.y >= low.y);
  });
  return cell;
}

std::vector<ReferenceRow> rows_of(const std::vector<ObservedPiece>& pieces, const Frame& ego, const Cell& cell) {
  std::vector<ReferenceRow> rows;
  for (const ObservedPiece& piece : pieces) {
    const double x = piece.middle_m.x - ego.x_m, y = piece.middle_m.y - ego.y_m;
    const double forward_m = ego.forward(x, y), left_m = ego.left(x, y);
    ReferenceRow row;
    row.inside_m = std::min({forward_m + kBehind_m, kAhead_m - forward_m, kAside_m - std::abs(left_m)});
    if (row.inside_m < -1) continue;
    row.distance_m = length(piece.middle_m.xy() - cell.center_m);
    row.features = ego.point(piece.middle_m);
    row.features.insert(row.features.end(),
                        {piece.half_length_m / kHalfLength_m, ego.forward(piece.direction.x, piece.direction.y),
                         ego.left(piece.direction.x, piece.direction.y), piece.extent});
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Returns a quantity scaled by the paper's training range; constants read 0.
double scaled(double value, const ConditioningRange& range) {
  if (range.low == range.high) return 0;
  return std::clamp(2 * (value - range.low) / (double{range.high} - range.low) - 1, -2.0, 1.0);
}

}  // namespace

ReferenceObservation reference_observation(Simulator& simulator, int slot) {
  const AgentStateView state = simulator.state();
  const SceneBatch& scene = simulator.scene();
  const SlotTable slots = simulator.slots();
  const auto world = static_cast<size_t>(slots.world_of_slot[slot]);
  const CompiledMap& map = *simulator.maps()[simulator.worlds()[world].map];
  const bool has_auxiliary = simulator.config().auxiliary_observations, has_lane = state.lane[slot] >= 0;
  const Frame ego{state.x_m[slot], state.y_m[slot], state.z_m[slot], std::cos(double{state.heading_rad[slot]}),
                  std::sin(double{state.heading_rad[slot]})};

  ReferenceObservation observation;
  observation.ego = {state.speed_mps[slot] / kSpeed_mps,
                     state.length_m[slot] / kLength_m,
                     state.width_m[slot] / kWidth_m,
                     state.steer_rad[slot] / kSteering_rad,
                     state.accel_long_mps2[slot] / kAcceleration_mps2,
                     state.accel_lat_mps2[slot] / kLateralAcceleration_mps2,
                     (has_lane ? state.speed_limit_mps[slot] : kNoLaneLimit_mps) / kSpeed_mps,
                     !has_auxiliary ? 0 : (has_lane ? state.lane_offset_m[slot] : kNoLane_m) / kLaneOffset_m,
                     has_auxiliary && has_lane ? std::cos(double{state.lane_angle_rad[slot]}) : 0};
  for (int i = 0; i < kNumConditioning; ++i) {
    observation.conditioning.push_back(scaled(state.conditioning[slot * kNumConditioning + i], kPaperConditioning[i]));
  }
  for (int i = 0; i < kNumWaypoints; ++i) {
    const int of = slot * kNumWaypoints + std::min(state.next_waypoint[slot] + i, kNumWaypoints - 1);
    const std::vector<double> point =
        ego.point({state.waypoint_x_m[of], state.waypoint_y_m[of], state.waypoint_z_m[of]});
    observation.waypoints.insert(observation.waypoints.end(), point.begin(), point.end());
  }

  const auto rows = [&](EntitySet set) -> std::vector<ReferenceRow>& {
    return observation.sets[static_cast<int>(set)];
  };
  const int first_slot = slots.slot_begin[world], num_agents = slots.slot_begin[world + 1] - first_slot;
  for (int box = scene.world_begin[world]; box < scene.world_begin[world + 1]; ++box) {
    const int agent = box - scene.world_begin[world];
    const bool is_parked = agent >= num_agents;
    const int other = first_slot + agent;
    if (other == slot || scene.agents[box].drawn == 0) continue;
    rows(EntitySet::partners)
        .push_back(partner(ego, scene.agents[box], has_auxiliary && !is_parked ? state.speed_mps[other] : 0));
  }
  const Cell cell = cell_of(*map.road, ego);
  observation.is_near_lane = cell.is_near_lane;
  observation.is_within_cells = cell.holds_ego;
  if (!cell.is_near_lane) return observation;
  const std::vector<TrafficLight>& lights = map.road->lights;
  const auto first_of_lane = std::find_if(lights.begin(), lights.end(), [&](const TrafficLight& light) {
    const auto begin = map.road->light_lanes.begin() + light.lanes.begin, end = begin + light.lanes.size();
    return std::find(begin, end, state.lane[slot]) != end;
  });
  for (auto light = lights.begin(); light != lights.end(); ++light) {
    const auto index = static_cast<size_t>(scene.light_begin[world] + (light - lights.begin()));
    rows(EntitySet::controls).push_back(control(ego, *light, scene.light_states[index], light == first_of_lane));
  }
  rows(EntitySet::lanes) = rows_of(map.rules.lane_pieces, ego, cell);
  rows(EntitySet::boundaries) = rows_of(map.rules.boundary_pieces, ego, cell);
  rows(EntitySet::walls) = rows_of(map.rules.wall_pieces, ego, cell);
  return observation;
}

}  // namespace pictura::testing
