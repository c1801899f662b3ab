#include "pictura/drawing/map_layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pictura/common/error.h"
#include "pictura/drawing/lane_shapes.h"

namespace pictura {

using Eigen::Vector2d;

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
  for (const ParkingSpace& space : map.parking_spaces) {
    grow(&box, space.center_m.xy(), 0.5f * std::hypot(space.length_m, space.width_m));
  }
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

GroundPen::GroundPen(Canvas& canvas, const Vector2d& left_top_m, double px_per_m)
    : canvas_(canvas), to_pixels_(to_pixels(left_top_m, px_per_m)), px_per_m_(px_per_m) {
  constexpr float kMargin_m = 1;  // painted lines extend beyond their bounding boxes
  visible_ = empty_box();
  for (const Vector2d& corner_px : {Vector2d{0, 0}, Vector2d(canvas.width_px(), canvas.height_px())}) {
    grow(&visible_, rounded(to_pixels_.inverse() * corner_px), kMargin_m);
  }
  cairo_save(context());
  const Eigen::Matrix3d& m = to_pixels_.matrix();
  const cairo_matrix_t matrix{m(0, 0), m(1, 0), m(0, 1), m(1, 1), m(0, 2), m(1, 2)};
  cairo_transform(context(), &matrix);
  cairo_set_line_join(context(), CAIRO_LINE_JOIN_ROUND);
}

GroundPen::~GroundPen() { cairo_restore(context()); }

double GroundPen::at_least(double metres, double min_px) const { return std::max(metres, min_px / px_per_m_); }

bool GroundPen::is_visible(const Aabb2& box) const {
  return box.low.x <= visible_.high.x && visible_.low.x <= box.high.x && box.low.y <= visible_.high.y &&
         visible_.low.y <= box.high.y;
}

bool GroundPen::is_visible(const Vector2d& position, double margin_m) const {
  Aabb2 box = empty_box();
  grow(&box, rounded(position), static_cast<float>(margin_m));
  return is_visible(box);
}

void GroundPen::line(const Vector2d& a, const Vector2d& b, double width_m, Rgb color, double alpha) {
  canvas_.set_color(color, alpha);
  cairo_set_line_width(context(), width_m);
  move_to(a);
  line_to(b);
  cairo_stroke(context());
}

void GroundPen::disk(const Vector2d& center, double radius_m, Rgb color, double alpha) {
  canvas_.set_color(color, alpha);
  cairo_new_sub_path(context());
  cairo_arc(context(), center.x(), center.y(), radius_m, 0, kTwoPi);
  cairo_fill(context());
}

void GroundPen::label(const Vector2d& position, const std::string& words, const TextStyle& style) {
  cairo_save(context());
  cairo_identity_matrix(context());
  const Vector2d at_px = to_pixels_ * position;
  canvas_.text(at_px.x(), at_px.y() + 0.35 * style.size_px, words, style);
  cairo_restore(context());
}

MapLayers::MapLayers(const RoadMap& map) : map_(map), lanes_in_order_(lanes_in_drawing_order(map)) {
  for (const Lane& lane : map.lanes) lane_boxes_.push_back(box_of(map.points_of(lane)));
  for (const Marking& marking : map.markings) {
    Aabb2 box = empty_box();
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      grow(&box, map.marking_points[i].xy(), 0.5f);
    }
    marking_boxes_.push_back(box);
  }
}

void MapLayers::paint(Canvas& canvas, const Vector2d& left_top_m, double px_per_m) const {
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
    if (!pen.is_visible(lane_boxes_[index])) continue;
    const Lane& lane = map_.lanes[index];
    cairo_new_path(context);
    for (const Vec2 corner : outline_of(map_, lane)) pen.line_to(in_plan(corner));
    cairo_close_path(context);
    pen.canvas().set_color(lane_color(lane.type));
    cairo_fill_preserve(context);
    // The outline is stroked, which makes the lane slightly wider, so that there is no seam between neighbouring lanes.
    cairo_set_line_width(context, pen.at_least(0.1, 0.7));
    cairo_stroke(context);
  }
}

void MapLayers::paint_parking_spaces(GroundPen& pen) const {
  cairo_t* context = pen.context();
  for (const ParkingSpace& space : map_.parking_spaces) {
    if (!pen.is_visible(in_plan(space.center_m), 0.5f * (space.length_m + space.width_m))) continue;
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

/// Paints bars across the direction of the longest side, along the whole outline, and clips them to the outline. The
/// whole outline is used, because recordings may divide a side into several sides.
void MapLayers::paint_crosswalk(GroundPen& pen, const Crosswalk& crosswalk) const {
  cairo_t* context = pen.context();
  const int32_t count = crosswalk.outline.size();
  const auto corner = [&](int32_t i) {
    return in_plan(map_.outline_points[crosswalk.outline.begin + (i + count) % count]);
  };
  Vector2d along{1, 0}, center{0, 0};
  double longest = 0;
  for (int32_t i = 0; i < count; ++i) {
    const Vector2d side = corner(i + 1) - corner(i);
    center += corner(i) / count;
    if (side.norm() > longest) {
      longest = side.norm();
      along = side / longest;
    }
  }
  double reach = 0, low = 0, high = 0;  // maximum distance of corners from the centre; range along `along`
  for (int32_t i = 0; i < count; ++i) {
    const Vector2d from_center = corner(i) - center;
    reach = std::max(reach, from_center.norm());
    low = std::min(low, from_center.dot(along));
    high = std::max(high, from_center.dot(along));
  }
  if (!pen.is_visible(center, reach)) return;
  cairo_save(context);
  cairo_new_path(context);
  for (int32_t i = 0; i < count; ++i) pen.line_to(corner(i));
  cairo_close_path(context);
  pen.canvas().set_color(paint_color(MarkColor::white), 0.25);
  cairo_fill_preserve(context);
  cairo_clip(context);
  const Vector2d across = reach * along.unitOrthogonal();
  pen.canvas().set_color(paint_color(MarkColor::white), 0.95);
  cairo_set_line_width(context, 0.5);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  for (double d = low; d <= high; d += 1) {
    const Vector2d middle = center + d * along;
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
    for (int32_t p = marking.points.begin; p < marking.points.end; ++p) pen.line_to(in_plan(map_.marking_points[p]));
    pen.canvas().set_color(paint_color(marking.color), 0.95);
    cairo_set_line_width(context, pen.at_least(marking.width_m, 0.6));
    cairo_stroke(context);
  }
  for (const PaintedStopLine& line : map_.stop_lines) {
    pen.line(in_plan(line.a_m), in_plan(line.b_m), pen.at_least(line.width_m, 1.5), kStopLineInk);
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
    pen.move_to(in_plan(edge.a_m));
    pen.line_to(in_plan(edge.b_m));
  }
  cairo_stroke(context);
}

void paint_light(Canvas& canvas, const TrafficLight& light, const Vector2d& left_top_m, double px_per_m, Rgb color) {
  GroundPen pen(canvas, left_top_m, px_per_m);
  cairo_t* context = pen.context();
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  pen.line(in_plan(light.stop_a_m), in_plan(light.stop_b_m), pen.at_least(0.7, 2.6), color);
  const double radius = pen.at_least(0.6, 2.2);
  const Vector2d facing = in_plan(light.head_facing), head = in_plan(light.head_m);
  const Vector2d pointer = 2.6 * radius * facing, left = radius * facing.unitOrthogonal();
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
