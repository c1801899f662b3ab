#include "pictura/drawing/map_layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pictura/common/error.h"
#include "pictura/drawing/lane_shapes.h"

namespace pictura {

namespace {

Aabb2 empty_box() {
  constexpr float kFar = std::numeric_limits<float>::max();
  return {{kFar, kFar}, {-kFar, -kFar}};
}

void grow(Aabb2* box_inout, Vec2 p, float margin) {
  box_inout->low = {min_of(box_inout->low.x, p.x - margin), min_of(box_inout->low.y, p.y - margin)};
  box_inout->high = {max_of(box_inout->high.x, p.x + margin), max_of(box_inout->high.y, p.y + margin)};
}

Aabb2 box_of(Span<const LanePoint> points) {
  Aabb2 box = empty_box();
  for (const LanePoint& point : points) grow(&box, point.position_m.xy(), 0.5f * point.width_m);
  return box;
}

}  // namespace

Aabb2 bounds_of(const RoadMap& map) {
  Aabb2 box = empty_box();
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
    case LaneType::driving: return hex(0x5B616B);
    case LaneType::bidirectional: return hex(0x6B6657);
    case LaneType::ramp: return hex(0x55617F);
    case LaneType::parking: return hex(0x7C8794);
    case LaneType::sidewalk: return hex(0xD3CEC2);
    case LaneType::shoulder: return hex(0xA9A8A2);
    case LaneType::stop: return hex(0x9C8F8A);
    case LaneType::biking: return hex(0x8FAE8B);
    case LaneType::median: return hex(0xB9C9A0);
    case LaneType::border: return hex(0xDADCCF);
    case LaneType::restricted: return hex(0xD9B8A8);
    case LaneType::other: return hex(0xC9C3D6);
  }
  return kGroundColor;
}

Rgb paint_color(MarkColor color) {
  switch (color) {
    case MarkColor::white: return hex(0xFBFBF7);
    case MarkColor::yellow: return hex(0xF2C230);
    case MarkColor::red: return hex(0xE5484D);
    case MarkColor::green: return hex(0x3FB950);
    case MarkColor::blue: return hex(0x4C9AFF);
    case MarkColor::orange: return hex(0xFF9433);
    case MarkColor::violet: return hex(0xB07CFF);
    case MarkColor::black: return hex(0x14161A);
  }
  return hex(0xFBFBF7);
}

Rgb phase_color(int phase) {
  constexpr std::array<Rgb, 6> kColors{hex(0x1F8FFF), hex(0xFF7A1A), hex(0x17B978),
                                       hex(0xC23BE0), hex(0xE8C21A), hex(0x00B8C4)};
  return kColors[static_cast<size_t>(phase) % kColors.size()];
}

GroundPen::GroundPen(Canvas& canvas, Vec2 left_top_m, double px_per_m)
    : canvas_(canvas), left_top_m_(left_top_m), px_per_m_(px_per_m) {
  constexpr float kMargin_m = 1;  // lines are wider than their boxes
  const auto width_m = static_cast<float>(canvas.width_px() / px_per_m);
  const auto height_m = static_cast<float>(canvas.height_px() / px_per_m);
  visible_ = {{left_top_m.x - kMargin_m, left_top_m.y - height_m - kMargin_m},
              {left_top_m.x + width_m + kMargin_m, left_top_m.y + kMargin_m}};
  cairo_save(context());
  cairo_scale(context(), px_per_m, -px_per_m);
  cairo_translate(context(), -left_top_m.x, -left_top_m.y);
  cairo_set_line_join(context(), CAIRO_LINE_JOIN_ROUND);
}

GroundPen::~GroundPen() { cairo_restore(context()); }

double GroundPen::at_least(double metres, double min_px) const { return std::max(metres, min_px / px_per_m_); }

bool GroundPen::is_visible(const Aabb2& box) const {
  return box.low.x <= visible_.high.x && visible_.low.x <= box.high.x && box.low.y <= visible_.high.y &&
         visible_.low.y <= box.high.y;
}

bool GroundPen::is_visible(Vec2 position, float margin_m) const {
  Aabb2 box = empty_box();
  grow(&box, position, margin_m);
  return is_visible(box);
}

void GroundPen::line(Vec2 a, Vec2 b, double width_m, Rgb color, double alpha) {
  canvas_.set_color(color, alpha);
  cairo_set_line_width(context(), width_m);
  move_to(a);
  line_to(b);
  cairo_stroke(context());
}

void GroundPen::disk(Vec2 center, double radius_m, Rgb color, double alpha) {
  canvas_.set_color(color, alpha);
  cairo_new_sub_path(context());
  cairo_arc(context(), center.x, center.y, radius_m, 0, kTwoPi);
  cairo_fill(context());
}

void GroundPen::label(Vec2 position, const std::string& words, const TextStyle& style) {
  cairo_save(context());
  cairo_identity_matrix(context());
  canvas_.text((position.x - left_top_m_.x) * px_per_m_,
               (left_top_m_.y - position.y) * px_per_m_ + 0.35 * style.size_px, words, style);
  cairo_restore(context());
}

MapLayers::MapLayers(const RoadMap& map) : map_(map), lanes_in_order_(lanes_in_drawing_order(map)) {
  for (const Lane& lane : map.lanes) lane_boxes_.push_back(box_of(map.points_of(lane)));
  for (const Marking& marking : map.markings) {
    Aabb2 box = empty_box();
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      grow(&box, map.marking_points[static_cast<size_t>(i)].xy(), 0.5f);
    }
    marking_boxes_.push_back(box);
  }
}

void MapLayers::paint(Canvas& canvas, Vec2 left_top_m, double px_per_m) const {
  GroundPen pen(canvas, left_top_m, px_per_m);
  paint_lanes(pen);
  paint_parking_spaces(pen);
  for (const Crosswalk& crosswalk : map_.crosswalks) paint_crosswalk(pen, crosswalk);
  paint_markings(pen);
  paint_road_edges(pen);
}

void MapLayers::paint_lanes(GroundPen& pen) const {
  cairo_t* context = pen.context();
  for (const int32_t index : lanes_in_order_) {
    if (!pen.is_visible(lane_boxes_[static_cast<size_t>(index)])) continue;
    const Lane& lane = map_.lanes[static_cast<size_t>(index)];
    cairo_new_path(context);
    for (const Vec2 corner : outline_of(map_, lane)) pen.line_to(corner);
    cairo_close_path(context);
    pen.canvas().set_color(lane_color(lane.type));
    cairo_fill_preserve(context);
    // Slightly wider than the lane, so that neighbours leave no seam.
    cairo_set_line_width(context, pen.at_least(0.1, 0.7));
    cairo_stroke(context);
  }
}

void MapLayers::paint_parking_spaces(GroundPen& pen) const {
  cairo_t* context = pen.context();
  for (const ParkingSpace& space : map_.parking_spaces) {
    if (!pen.is_visible(space.center_m.xy(), 0.5f * (space.length_m + space.width_m))) continue;
    cairo_save(context);
    cairo_translate(context, space.center_m.x, space.center_m.y);
    cairo_rotate(context, space.heading_rad);
    cairo_rectangle(context, -0.5 * space.length_m, -0.5 * space.width_m, space.length_m, space.width_m);
    cairo_restore(context);
    pen.canvas().set_color(kParkingSpaceInk);
    cairo_set_line_width(context, pen.at_least(0.12, 0.5));
    cairo_stroke(context);
  }
}

/// Bars across the longest side's direction, clipped to the outline.
void MapLayers::paint_crosswalk(GroundPen& pen, const Crosswalk& crosswalk) const {
  cairo_t* context = pen.context();
  const int32_t count = crosswalk.outline.size();
  const auto corner = [&](int32_t i) {
    return map_.outline_points[static_cast<size_t>(crosswalk.outline.begin + (i + count) % count)].xy();
  };
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
  if (!pen.is_visible(center, longest)) return;
  cairo_save(context);
  cairo_new_path(context);
  for (int32_t i = 0; i < count; ++i) pen.line_to(corner(i));
  cairo_close_path(context);
  pen.canvas().set_color(paint_color(MarkColor::white), 0.25);
  cairo_fill_preserve(context);
  cairo_clip(context);
  const Vec2 across = left_normal(along) * longest;
  pen.canvas().set_color(paint_color(MarkColor::white), 0.95);
  cairo_set_line_width(context, 0.5);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  for (float d = -0.5f * longest; d <= 0.5f * longest; d += 1.0f) {
    const Vec2 middle = center + along * d;
    pen.move_to(middle - across);
    pen.line_to(middle + across);
  }
  cairo_stroke(context);
  cairo_restore(context);
}

void MapLayers::paint_markings(GroundPen& pen) const {
  cairo_t* context = pen.context();
  for (size_t i = 0; i < map_.markings.size(); ++i) {
    if (!pen.is_visible(marking_boxes_[i])) continue;
    const Marking& marking = map_.markings[i];
    cairo_new_path(context);
    for (int32_t p = marking.points.begin; p < marking.points.end; ++p)
      pen.line_to(map_.marking_points[static_cast<size_t>(p)].xy());
    pen.canvas().set_color(paint_color(marking.color), 0.95);
    cairo_set_line_width(context, pen.at_least(marking.width_m, 0.6));
    cairo_stroke(context);
  }
  for (const PaintedStopLine& line : map_.stop_lines) {
    pen.line(line.a_m.xy(), line.b_m.xy(), pen.at_least(line.width_m, 1.5), kStopLineInk);
  }
}

void MapLayers::paint_road_edges(GroundPen& pen) const {
  cairo_t* context = pen.context();
  pen.canvas().set_color(kRoadEdgeInk);
  cairo_set_line_width(context, pen.at_least(0.15, 0.7));
  cairo_set_line_cap(context, CAIRO_LINE_CAP_ROUND);
  for (const RoadEdge& edge : map_.road_edges) {
    Aabb2 box = empty_box();
    grow(&box, edge.a_m.xy(), 0);
    grow(&box, edge.b_m.xy(), 0);
    if (!pen.is_visible(box)) continue;
    pen.move_to(edge.a_m.xy());
    pen.line_to(edge.b_m.xy());
  }
  cairo_stroke(context);
}

void paint_light(Canvas& canvas, const TrafficLight& light, Vec2 left_top_m, double px_per_m, Rgb color) {
  GroundPen pen(canvas, left_top_m, px_per_m);
  cairo_t* context = pen.context();
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  pen.line(light.stop_a_m.xy(), light.stop_b_m.xy(), pen.at_least(0.7, 2.6), color);
  const double radius = pen.at_least(0.6, 2.2);
  const Vec2 pointer = light.head_facing * static_cast<float>(2.6 * radius);
  const Vec2 left = left_normal(light.head_facing) * static_cast<float>(radius);
  const Vec2 head = light.head_m.xy();
  const Rgb housing = hex(0x1E2126);
  pen.move_to(head + left);
  pen.line_to(head + pointer);
  pen.line_to(head - left);
  cairo_close_path(context);
  canvas.set_color(housing);
  cairo_fill(context);
  pen.disk(head, 1.3 * radius, housing);
  pen.disk(head, radius, color);
}

}  // namespace pictura
