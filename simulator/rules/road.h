// Position of an agent on the lane network and on the drivable surface.
#pragma once

#include "pictura/map/speed_limit.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/rules/thread_group.h"

namespace pictura {

/// Margin on both sides of each lane, to cover gaps between lanes.
constexpr float kSeamTolerance_m = 0.1f;
/// Offset of an agent on no lane, as in the paper's reference implementation. The angle of such an agent is a right
/// angle.
constexpr float kNoLaneOffset_m = 4.0f;

/// Position of an agent relative to its lane.
struct LaneFit {
  int32_t lane = -1;
  float offset_m = kNoLaneOffset_m;  // positive to the left of the centre line
  float angle_rad = kHalfPi;         // heading minus the lane's direction
  float z_m = 0;
  float speed_limit_mps = kDefaultSpeedLimit_mps;
};

/// Foot of the perpendicular to a segment.
struct Foot {
  float along_m = 0;  // in [0, length]
  float distance_m = 0;
  float side = 0;  // positive to the left
};

PICTURA_HD inline Foot foot_on(const LaneSegment& segment, Vec2 p) {
  const Vec2 from_a = p - segment.a_m.xy();
  const float along = clamp(dot(from_a, segment.direction), 0.0f, segment.length_m);
  return {along, length(from_a - segment.direction * along), cross(segment.direction, from_a)};
}

/// Returns the lane of minimum cost. The cost is the distance to the centre line (0.7 per 4 m) plus the angle to it
/// (0.3 per half turn). Lanes other than current_lane (-1: none) cost 0.05 more, so that an agent between two lanes
/// stays on its lane. Considers only lanes on the level of z_m. Without a lane within kLaneReach_m, returns lane -1 and
/// height z_m.
template <typename ThreadGroup = SingleThread>
PICTURA_HD LaneFit fit_lane(const MapView& map, Vec2 p, float z_m, float heading_rad, int32_t current_lane,
                            const ThreadGroup& group = {}) {
  constexpr float kDistanceWeight = 0.7f / 4.0f;
  constexpr float kAngleWeight = 0.3f / kPi;
  constexpr float kHysteresis = 0.05f;
  LaneFit best;
  best.z_m = z_m;
  float best_score = 1e9f;
  const Span<const int32_t> items = items_at(map.segment_cells, p);
  const int num_items = static_cast<int>(items.size());
  int best_item = num_items;
  for (int i = group.rank(); i < num_items; i += group.size()) {
    const LaneSegment& segment = map.segments[items[i]];
    if (!segment.is_driven) continue;
    const Foot foot = foot_on(segment, p);
    const float height = height_on(segment, foot.along_m);
    const float score_without_angle =
        kDistanceWeight * foot.distance_m + (segment.lane == current_lane ? 0.0f : kHysteresis);
    if (foot.distance_m > kLaneReach_m || score_without_angle >= best_score || fabsf(height - z_m) >= kLevel_m)
      continue;
    const float lane_heading = segment.heading_rad + segment.turn_rad * (foot.along_m / segment.length_m);
    const float angle = wrap_angle(heading_rad - lane_heading);
    const float score = score_without_angle + kAngleWeight * fabsf(angle);
    if (score >= best_score) continue;
    best_score = score;
    best_item = i;
    best = {segment.lane, foot.side < 0.0f ? -foot.distance_m : foot.distance_m, angle, height,
            map.lanes[segment.lane].speed_limit_mps};
  }
  return group.of_lowest(best_score, best_item, best);
}

/// Whether a point is on the drivable surface of its level: within half a lane's width of a centre line. On maps with a
/// record, it must be on the road's side of the nearest edge, because lanes do not give the road's extent.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool is_on_road(const MapView& map, Vec2 p, float z_m, const ThreadGroup& group = {}) {
  if (has_record(map)) return road_side(map.side_edges, map.side_cells, {p.x, p.y, z_m}, group).is_on_road;
  const Span<const int32_t> items = items_at(map.segment_cells, p);
  bool is_on = false;
  for (size_t i = static_cast<size_t>(group.rank()); i < items.size() && !is_on;
       i += static_cast<size_t>(group.size())) {
    const LaneSegment& segment = map.segments[items[i]];
    const Foot foot = foot_on(segment, p);
    const float height = height_on(segment, foot.along_m);
    is_on = foot.distance_m <= segment.half_width_m + kSeamTolerance_m && fabsf(height - z_m) < kLevel_m;
  }
  return group.any(is_on);
}

/// A lane or a piece of a walkway, and the arc length on it.
struct RoutePoint {
  int32_t lane = -1;
  float s_m = 0;
};

struct LanePose {
  Vec3 position_m;
  float heading_rad = 0;
};

/// s_m is clamped to the lane.
PICTURA_HD inline LanePose pose_on_lane(const MapView& map, int32_t lane_index, float s_m) {
  const MapLane& lane = map.lanes[lane_index];
  int low = lane.first_segment, high = lane.first_segment + lane.num_segments - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (map.segments[middle].s_m <= s_m) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  const LaneSegment& segment = map.segments[low];
  const float along = clamp(s_m - segment.s_m, 0.0f, segment.length_m);
  const Vec2 xy = segment.a_m.xy() + segment.direction * along;
  return {{xy.x, xy.y, height_on(segment, along)},
          wrap_angle(segment.heading_rad + segment.turn_rad * (along / segment.length_m))};
}

}  // namespace pictura
