#include "pictura/apps/draw_layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr Rgb kParkingBayColor = hex(0xC9D2DE);
constexpr Rgb kPaintColor = hex(0xFBFBF7);
constexpr Rgb kYellowPaintColor = hex(0xF2C230);
constexpr Rgb kEdgeColor = hex(0xC8312F);

Aabb2 nothing() {
  constexpr float kFar = std::numeric_limits<float>::max();
  return {{kFar, kFar}, {-kFar, -kFar}};
}

void grow(Aabb2* box_inout, Vec2 p, float margin) {
  box_inout->low = {min_of(box_inout->low.x, p.x - margin), min_of(box_inout->low.y, p.y - margin)};
  box_inout->high = {max_of(box_inout->high.x, p.x + margin), max_of(box_inout->high.y, p.y + margin)};
}

bool overlap(const Aabb2& a, const Aabb2& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y;
}

Aabb2 box_of(Span<const LanePoint> points) {
  Aabb2 box = nothing();
  for (const LanePoint& point : points) grow(&box, point.position_m.xy(), 0.5f * point.width_m);
  return box;
}

Vec2 border(const LanePoint& point, float side) {
  const Vec2 left{-std::sin(point.heading_rad), std::cos(point.heading_rad)};
  return point.position_m.xy() + left * (side * 0.5f * point.width_m);
}

/// Later layers cover earlier ones.
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

Aabb2 bounds_of(const RoadMap& map) {
  Aabb2 box = nothing();
  for (const Lane& lane : map.lanes) {
    const Aabb2 of_lane = box_of(map.points_of(lane));
    grow(&box, of_lane.low, 0);
    grow(&box, of_lane.high, 0);
  }
  for (const RoadEdge& edge : map.road_edges) {
    grow(&box, edge.a_m.xy(), 0);
    grow(&box, edge.b_m.xy(), 0);
  }
  for (const Vec3& point : map.marking_points) grow(&box, point.xy(), 0);
  PICTURA_CHECK(box.low.x <= box.high.x, "{}: the map has nothing to draw", map.name);
  return box;
}

Rgb lane_color(LaneType type) {
  switch (type) {
    case LaneType::driving:
    case LaneType::ramp: return hex(0x5B616B);
    case LaneType::bidirectional: return hex(0x6B6657);
    case LaneType::parking: return hex(0x7C8794);
    case LaneType::sidewalk: return hex(0xD3CEC2);
    case LaneType::shoulder:
    case LaneType::stop: return hex(0xA9A8A2);
    case LaneType::biking: return hex(0x8FAE8B);
    case LaneType::median: return hex(0xB9C9A0);
    default: return hex(0xDADCCF);
  }
}

Rgb phase_color(int phase) {
  constexpr std::array<Rgb, 6> kColors{hex(0x1F8FFF), hex(0xFF7A1A), hex(0x17B978),
                                       hex(0xC23BE0), hex(0xE8C21A), hex(0x00B8C4)};
  return kColors[static_cast<size_t>(phase) % kColors.size()];
}

MapLayers::MapLayers(const RoadMap& map) : map_(map) {
  for (size_t i = 0; i < map.lanes.size(); ++i) {
    lane_boxes_.push_back(box_of(map.points_of(map.lanes[i])));
    lanes_in_order_.push_back(static_cast<int32_t>(i));
  }
  // What lies higher covers what lies lower, in steps of a storey; bridges thus show above the road that they cross.
  const auto storey = [&](int32_t lane) {
    return std::floor((map.points_of(map.lanes[static_cast<size_t>(lane)])[0].position_m.z + 2.0f) / 4.0f);
  };
  std::stable_sort(lanes_in_order_.begin(), lanes_in_order_.end(), [&](int32_t a, int32_t b) {
    const float storey_a = storey(a), storey_b = storey(b);
    if (storey_a != storey_b) return storey_a < storey_b;
    return layer_of(map.lanes[static_cast<size_t>(a)].type) < layer_of(map.lanes[static_cast<size_t>(b)].type);
  });
  for (const Marking& marking : map.markings) {
    Aabb2 box = nothing();
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      grow(&box, map.marking_points[static_cast<size_t>(i)].xy(), 0.5f);
    }
    marking_boxes_.push_back(box);
  }
}

void MapLayers::paint(Canvas& canvas, Vec2 left_top_m, double px_per_m) const {
  cairo_t* context = canvas.context();
  const auto width_m = static_cast<float>(canvas.width_px() / px_per_m);
  const auto height_m = static_cast<float>(canvas.height_px() / px_per_m);
  const Aabb2 visible{{left_top_m.x - 1.0f, left_top_m.y - height_m - 1.0f},
                      {left_top_m.x + width_m + 1.0f, left_top_m.y + 1.0f}};
  cairo_save(context);
  cairo_scale(context, px_per_m, -px_per_m);
  cairo_translate(context, -left_top_m.x, -left_top_m.y);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
  const auto width_of = [&](double metres, double least_px) { return std::max(metres, least_px / px_per_m); };
  const auto line_to = [&](Vec2 p) { cairo_line_to(context, p.x, p.y); };

  for (const int32_t index : lanes_in_order_) {
    if (!overlap(lane_boxes_[static_cast<size_t>(index)], visible)) continue;
    const Lane& lane = map_.lanes[static_cast<size_t>(index)];
    const Span<const LanePoint> points = map_.points_of(lane);
    cairo_new_path(context);
    for (const LanePoint& point : points) line_to(border(point, 1));
    for (size_t i = points.size(); i-- > 0;) line_to(border(points[i], -1));
    cairo_close_path(context);
    canvas.set_color(lane_color(lane.type));
    cairo_fill_preserve(context);
    // A hair wider than the lane, so that neighbours leave no seam.
    cairo_set_line_width(context, width_of(0.1, 0.7));
    cairo_stroke(context);
  }

  for (const ParkingSpace& space : map_.parking_spaces) {
    cairo_save(context);
    cairo_translate(context, space.center_m.x, space.center_m.y);
    cairo_rotate(context, space.heading_rad);
    cairo_rectangle(context, -0.5 * space.length_m, -0.5 * space.width_m, space.length_m, space.width_m);
    cairo_restore(context);
    canvas.set_color(kParkingBayColor);
    cairo_set_line_width(context, width_of(0.12, 0.5));
    cairo_stroke(context);
  }

  for (const Crosswalk& crosswalk : map_.crosswalks) {
    const int32_t count = crosswalk.outline.size();
    const auto corner = [&](int32_t i) {
      return map_.outline_points[static_cast<size_t>(crosswalk.outline.begin + (i + count) % count)].xy();
    };
    // Bars across the longest side's direction, clipped to the outline.
    Vec2 along{1, 0};
    float longest = 0;
    Vec2 center;
    for (int32_t i = 0; i < count; ++i) {
      const Vec2 side = corner(i + 1) - corner(i);
      center = center + corner(i) * (1.0f / static_cast<float>(count));
      if (length(side) > longest) {
        longest = length(side);
        along = side * (1.0f / longest);
      }
    }
    cairo_save(context);
    cairo_new_path(context);
    for (int32_t i = 0; i < count; ++i) line_to(corner(i));
    cairo_close_path(context);
    canvas.set_color(kPaintColor, 0.25);
    cairo_fill_preserve(context);
    cairo_clip(context);
    const Vec2 across = left_normal(along) * longest;
    canvas.set_color(kPaintColor, 0.95);
    cairo_set_line_width(context, 0.5);
    cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
    for (float d = -0.5f * longest; d <= 0.5f * longest; d += 1.0f) {
      const Vec2 middle = center + along * d;
      cairo_move_to(context, (middle - across).x, (middle - across).y);
      line_to(middle + across);
    }
    cairo_stroke(context);
    cairo_restore(context);
  }

  for (size_t i = 0; i < map_.markings.size(); ++i) {
    if (!overlap(marking_boxes_[i], visible)) continue;
    const Marking& marking = map_.markings[i];
    cairo_new_path(context);
    for (int32_t p = marking.points.begin; p < marking.points.end; ++p)
      line_to(map_.marking_points[static_cast<size_t>(p)].xy());
    canvas.set_color(marking.color == MarkColor::yellow ? kYellowPaintColor : kPaintColor, 0.95);
    cairo_set_line_width(context, width_of(marking.width_m, 0.6));
    cairo_stroke(context);
  }

  canvas.set_color(kEdgeColor);
  cairo_set_line_width(context, width_of(0.15, 0.7));
  cairo_set_line_cap(context, CAIRO_LINE_CAP_ROUND);
  for (const RoadEdge& edge : map_.road_edges) {
    Aabb2 box = nothing();
    grow(&box, edge.a_m.xy(), 0);
    grow(&box, edge.b_m.xy(), 0);
    if (!overlap(box, visible)) continue;
    cairo_move_to(context, edge.a_m.x, edge.a_m.y);
    line_to(edge.b_m.xy());
  }
  cairo_stroke(context);
  cairo_restore(context);
}

void paint_light(Canvas& canvas, const TrafficLight& light, Vec2 left_top_m, double px_per_m, Rgb color) {
  cairo_t* context = canvas.context();
  cairo_save(context);
  cairo_scale(context, px_per_m, -px_per_m);
  cairo_translate(context, -left_top_m.x, -left_top_m.y);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  const auto at_least_px = [&](double metres, double px) { return std::max(metres, px / px_per_m); };
  const auto line = [&](Vec3 a, Vec3 b, double width, Rgb paint) {
    canvas.set_color(paint);
    cairo_set_line_width(context, width);
    cairo_move_to(context, a.x, a.y);
    cairo_line_to(context, b.x, b.y);
    cairo_stroke(context);
  };
  line(light.stop_a_m, light.stop_b_m, at_least_px(0.7, 2.6), color);
  const double radius = at_least_px(0.6, 2.2);
  const Vec2 beak = light.head_facing * static_cast<float>(2.6 * radius);
  const Vec2 left = left_normal(light.head_facing) * static_cast<float>(radius);
  const Vec2 head = light.head_m.xy();
  const Rgb housing = hex(0x1E2126);
  cairo_move_to(context, (head + left).x, (head + left).y);
  cairo_line_to(context, (head + beak).x, (head + beak).y);
  cairo_line_to(context, (head - left).x, (head - left).y);
  cairo_close_path(context);
  canvas.set_color(housing);
  cairo_fill(context);
  cairo_arc(context, head.x, head.y, 1.3 * radius, 0, kTwoPi);
  cairo_fill(context);
  canvas.set_color(color);
  cairo_arc(context, head.x, head.y, radius, 0, kTwoPi);
  cairo_fill(context);
  cairo_restore(context);
}

}  // namespace pictura
