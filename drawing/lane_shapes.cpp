#include "pictura/drawing/lane_shapes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pictura/drawing/plan.h"

namespace pictura {

namespace {

/// Point of a lane's left border (side 1) or right border (side -1).
Vec2 border(const LanePoint& point, double side) {
  const Eigen::Isometry2d pose = pose_in_plan(in_plan(point.position_m), point.heading_rad);
  return rounded(pose * Eigen::Vector2d{0, side * 0.5 * point.width_m});
}

/// Drawing layer of a lane type. Higher layers cover lower layers.
int layer_of(LaneType type) {
  switch (type) {
    case LaneType::sidewalk: return 0;
    case LaneType::border:
    case LaneType::median:
    case LaneType::restricted:
    case LaneType::other: return 1;
    case LaneType::stop:
    case LaneType::shoulder: return 2;
    case LaneType::biking: return 3;
    case LaneType::parking: return 4;
    default: return 5;
  }
}

}  // namespace

std::vector<int32_t> lanes_in_drawing_order(const RoadMap& map) {
  std::vector<int32_t> order(map.lanes.size());
  std::iota(order.begin(), order.end(), 0);
  const auto storey = [&](int32_t lane) {
    return std::floor((map.points_of(map.lanes[lane])[0].position_m.z + 2.0f) / 4.0f);
  };
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    const float storey_a = storey(a), storey_b = storey(b);
    if (storey_a != storey_b) return storey_a < storey_b;
    return layer_of(map.lanes[a].type) < layer_of(map.lanes[b].type);
  });
  return order;
}

std::vector<Vec2> outline_of(const RoadMap& map, const Lane& lane) {
  const Span<const LanePoint> points = map.points_of(lane);
  std::vector<Vec2> ring;
  for (const LanePoint& point : points) ring.push_back(border(point, 1));
  for (size_t i = points.size(); i-- > 0;) ring.push_back(border(points[i], -1));
  return ring;
}

}  // namespace pictura
