#include "pictura/map/scenario/drivable_area.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pictura {

namespace {

constexpr float kEdgeCell_m = 10.0f;
constexpr float kMeet_m = 0.01f;   // maximum distance between the ends of consecutive pieces of a polyline
constexpr float kClosed_m = 1.0f;  // maximum distance between the ends of a polyline that forms a ring
constexpr float kMoving_mps = 0.5f;

Aabb2 box_of(Vec2 a, Vec2 b, float margin_m) {
  return {{min_of(a.x, b.x) - margin_m, min_of(a.y, b.y) - margin_m},
          {max_of(a.x, b.x) + margin_m, max_of(a.y, b.y) + margin_m}};
}

}  // namespace

SideEdges side_edges_of(const RoadMap& map) {
  SideEdges sides;
  std::vector<SideEdge>& edges = sides.edges;
  std::vector<Aabb2> boxes;
  std::size_t first = 0;  // first piece of the polyline
  const auto finish = [&](std::size_t end) {
    if (end - first > 1 && length((edges[end - 1].b_m - edges[first].a_m).xy()) <= kClosed_m) {
      edges[end - 1].next = static_cast<int32_t>(first);
      edges[first].before = static_cast<int32_t>(end - 1);
    }
    first = end;
  };
  for (const RoadEdge& edge : map.road_edges) {
    const std::size_t index = edges.size();
    const Vec2 way = (edge.b_m - edge.a_m).xy();
    const float length_m = length(way);
    SideEdge added{edge.a_m, edge.b_m, Vec2{-way.y, way.x} * (1.0f / max_of(length_m, 1e-6f))};
    if (index > first && length((edges.back().b_m - edge.a_m).xy()) <= kMeet_m) {
      edges.back().next = static_cast<int32_t>(index);
      added.before = static_cast<int32_t>(index) - 1;
    } else {
      finish(index);
    }
    edges.push_back(added);
    boxes.push_back(box_of(edge.a_m.xy(), edge.b_m.xy(), 0));
  }
  finish(edges.size());
  sides.cells = Grid(boxes, kEdgeCell_m);
  return sides;
}

bool DrivableArea::touches_edge(const GroundBox& box) const {
  const Vec2 forward{std::cos(box.heading_rad), std::sin(box.heading_rad)}, left{-forward.y, forward.x};
  const float half_length = 0.5f * box.length_m, half_width = 0.5f * box.width_m;
  const float reach_m = half_length + half_width;
  bool touches = false;
  visit_items(sides_.cells.view(), box_of(box.center_m.xy(), box.center_m.xy(), reach_m), [&](std::size_t index) {
    if (touches) return;
    const SideEdge& edge = sides_.edges[index];
    const Vec2 a = (edge.a_m - box.center_m).xy(), way = (edge.b_m - edge.a_m).xy();
    // The part from begin to end of the edge is between both pairs of sides of the box.
    float begin = 0, end = 1;
    for (const auto& [axis, half] : {std::pair{forward, half_length}, std::pair{left, half_width}}) {
      const float at = dot(a, axis), rate = dot(way, axis);
      if (std::abs(rate) < 1e-9f) {
        if (std::abs(at) > half) return;
        continue;
      }
      const float t0 = (-half - at) / rate, t1 = (half - at) / rate;
      begin = max_of(begin, min_of(t0, t1));
      end = min_of(end, max_of(t0, t1));
    }
    if (begin > end) return;
    const float z = edge.a_m.z + 0.5f * (begin + end) * (edge.b_m.z - edge.a_m.z);
    touches = std::abs(z - box.center_m.z) < kSameRoadLevel_m;
  });
  return touches;
}

LoggedDriving logged_driving(const Scenario& scenario) {
  const DrivableArea area(scenario.map);
  LoggedDriving driving;
  for (std::size_t i = 0; i < scenario.tracks.size(); ++i) {
    const RecordedTrack& track = scenario.tracks[i];
    const auto index = static_cast<int32_t>(i);
    if (track.type != TrackType::vehicle || !is_moving(scenario, index)) continue;
    const Span<const TrackState> states = scenario.states_of(index);
    const Span<const uint8_t> valid = scenario.valid_of(index);
    for (std::size_t step = 0; step < states.size(); ++step) {
      const TrackState& state = states[step];
      if (!valid[step] || length(state.velocity_mps) < kMoving_mps) continue;
      ++driving.vehicle_steps;
      driving.touching +=
          area.touches_edge({state.position_m, state.heading_rad, track.length_m, track.width_m}) ? 1 : 0;
      driving.off_road += area.side_of(state.position_m).is_on_road ? 0 : 1;
    }
  }
  return driving;
}

}  // namespace pictura
