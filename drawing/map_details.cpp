#include "pictura/drawing/map_details.h"

#include <cmath>

#include <fmt/format.h>

#include "pictura/map/map_geometry.h"

namespace pictura {

using Eigen::Isometry2d;
using Eigen::Vector2d;

namespace {

// Minimum scales of arrows, names and lane numbers, in pixels per metre.
constexpr double kArrowScale = 1.5, kNameScale = 5, kNumberScale = 9;

/// Pose on a lane's centre line, s_m metres from the lane's start.
Isometry2d pose_at(Span<const LanePoint> points, double s_m) {
  size_t i = 1;
  while (i + 1 < points.size() && points[i].s_m < s_m) ++i;
  const LanePoint &before = points[i - 1], &after = points[i];
  const double share = (s_m - before.s_m) / (after.s_m - before.s_m);
  const Vector2d a = in_plan(before.position_m), b = in_plan(after.position_m);
  return pose_in_plan(a + share * (b - a), before.heading_rad);
}

/// Paints chevrons along the lane, at a spacing that suits the scale.
void paint_arrows(GroundPen& pen, const RoadMap& map, const Lane& lane) {
  const double spacing_m = pen.at_least(12, 70), size_m = pen.at_least(0.7, 2.5);
  const auto count = static_cast<int>(std::max(1.0, lane.length_m / spacing_m));
  cairo_set_line_width(pen.context(), pen.at_least(0.18, 0.8));
  pen.canvas().set_color(hex(0xFFFFFF), 0.45);
  for (int i = 0; i < count; ++i) {
    const Isometry2d pose = pose_at(map.points_of(lane), lane.length_m * (i + 0.5) / count);
    if (!pen.is_visible(pose.translation(), 1)) continue;
    pen.move_to(pose * Vector2d{-0.6 * size_m, size_m});
    pen.line_to(pose * Vector2d{0.6 * size_m, 0});
    pen.line_to(pose * Vector2d{-0.6 * size_m, -size_m});
    cairo_stroke(pen.context());
  }
}

void paint_lane_number(GroundPen& pen, const RoadMap& map, size_t index) {
  const Lane& lane = map.lanes[index];
  // Position before the lane's middle, where the lane may have an arrow.
  const Vector2d position = pose_at(map.points_of(lane), 0.5 * lane.length_m) * Vector2d{-14 / pen.px_per_m(), 0};
  if (!pen.is_visible(position, 1)) return;
  const bool on_dark = is_drivable(lane.type);
  pen.label(position, fmt::format("{}", index),
            {.size_px = 9, .align = Align::center, .color = on_dark ? hex(0xE6E9ED) : hex(0x5A6068)});
}

/// Paints the line, with shading on the side of its buildings.
void paint_building_line(GroundPen& pen, const BuildingLine& line) {
  const Vector2d a = in_plan(line.a_m), b = in_plan(line.b_m), along = b - a;
  if (along.isZero(0) || !pen.is_visible(0.5 * (a + b), along.norm())) return;
  const double depth_m = pen.at_least(1.2, 3);
  const Vector2d back = 0.5 * depth_m * along.unitOrthogonal();
  pen.line(a + back, b + back, depth_m, kBuildingLineInk, 0.25);
  pen.line(a, b, pen.at_least(0.2, 1), kBuildingLineInk);
}

/// Paints the angle within which the light's head is visible, and a line from the head to its stop line.
void paint_light_angle(GroundPen& pen, const TrafficLight& light) {
  const float half_angle = MapGeometryOptions{}.light_half_angle_rad;
  const double radius_m = pen.at_least(6, 14);
  const Vector2d head = in_plan(light.head_m);
  const double facing = std::atan2(light.head_facing.y, light.head_facing.x);
  const Rgb color = phase_color(light.phase);
  cairo_new_path(pen.context());
  pen.move_to(head);
  cairo_arc(pen.context(), head.x(), head.y(), radius_m, facing - half_angle, facing + half_angle);
  cairo_close_path(pen.context());
  pen.canvas().set_color(color, 0.22);
  cairo_fill_preserve(pen.context());
  pen.canvas().set_color(color, 0.8);
  cairo_set_line_width(pen.context(), pen.at_least(0.08, 0.6));
  cairo_stroke(pen.context());
  const double dash = pen.at_least(0.5, 3);
  cairo_set_dash(pen.context(), &dash, 1, 0);
  pen.line(head, 0.5 * (in_plan(light.stop_a_m) + in_plan(light.stop_b_m)), pen.at_least(0.08, 0.6), color, 0.8);
  cairo_set_dash(pen.context(), nullptr, 0, 0);
}

/// Paints a diamond with a tail towards the traffic to which the sign applies.
void paint_sign(GroundPen& pen, const Sign& sign) {
  const Vector2d position = in_plan(sign.position_m);
  const double radius_m = pen.at_least(0.7, 3);
  if (!pen.is_visible(position, 3 * radius_m)) return;
  const Vector2d tail = pose_in_plan(position, sign.heading_rad) * Vector2d{-2.6 * radius_m, 0};
  pen.line(position, tail, pen.at_least(0.15, 0.8), kSignInk);
  sign_path(pen.context(), position.x(), position.y(), radius_m);
  pen.canvas().set_color(kSignInk);
  cairo_fill_preserve(pen.context());
  pen.canvas().set_color(hex(0xFFFFFF));
  cairo_set_line_width(pen.context(), pen.at_least(0.1, 0.6));
  cairo_stroke(pen.context());
}

/// Paints a name behind the light or sign, where no part of the light or sign is drawn.
void paint_name(GroundPen& pen, const Vector2d& position, const Vector2d& facing, const std::string& name, Rgb color) {
  if (!pen.is_visible(position, 1)) return;
  const Vector2d behind = position - 11 / pen.px_per_m() * facing;
  const Align align = facing.x() > 0.4 ? Align::right : (facing.x() < -0.4 ? Align::left : Align::center);
  pen.label(behind, name, {.size_px = 10, .bold = true, .align = align, .color = color});
}

}  // namespace

void sign_path(cairo_t* context, double x, double y, double radius) {
  cairo_new_path(context);
  cairo_move_to(context, x - radius, y);
  cairo_line_to(context, x, y + radius);
  cairo_line_to(context, x + radius, y);
  cairo_line_to(context, x, y - radius);
  cairo_close_path(context);
}

void paint_details(const RoadMap& map, Canvas& canvas, const Vector2d& left_top_m, double px_per_m) {
  {
    GroundPen pen(canvas, left_top_m, px_per_m);
    cairo_set_line_cap(pen.context(), CAIRO_LINE_CAP_BUTT);
    for (const BuildingLine& line : map.building_lines) paint_building_line(pen, line);
    if (px_per_m >= kArrowScale) {
      for (const Lane& lane : map.lanes) {
        if (lane.type == LaneType::driving || lane.type == LaneType::ramp) paint_arrows(pen, map, lane);
      }
    }
    for (const TrafficLight& light : map.lights) paint_light_angle(pen, light);
  }
  for (const TrafficLight& light : map.lights) {
    paint_light(canvas, light, left_top_m, px_per_m, phase_color(light.phase));
  }
  GroundPen pen(canvas, left_top_m, px_per_m);
  for (const Sign& sign : map.signs) paint_sign(pen, sign);
  if (px_per_m >= kNumberScale) {
    for (size_t i = 0; i < map.lanes.size(); ++i) paint_lane_number(pen, map, i);
  }
  if (px_per_m < kNameScale) return;
  for (const Sign& sign : map.signs) {
    paint_name(pen, in_plan(sign.position_m), Eigen::Rotation2Dd(sign.heading_rad) * -Vector2d::UnitX(), sign.type,
               kSignInk);
  }
  for (const TrafficLight& light : map.lights) {
    paint_name(pen, in_plan(light.head_m), in_plan(light.head_facing), light.name, hex(0x1E2126));
  }
}

}  // namespace pictura
