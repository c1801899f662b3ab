#include "pictura/drawing/map_details.h"

#include <cmath>

#include <fmt/format.h>

#include "pictura/map/map_geometry.h"

namespace pictura {

namespace {

// Minimum scales of arrows, names and lane numbers, in pixels a metre.
constexpr double kArrowScale = 1.5, kNameScale = 5, kNumberScale = 9;

Vec2 direction(float heading_rad) { return {std::cos(heading_rad), std::sin(heading_rad)}; }

/// Position and heading on a lane's centre line s metres from its start.
struct LanePose {
  Vec2 position_m;
  float heading_rad;
};
LanePose pose_at(Span<const LanePoint> points, float s_m) {
  size_t i = 1;
  while (i + 1 < points.size() && points[i].s_m < s_m) ++i;
  const float share = (s_m - points[i - 1].s_m) / (points[i].s_m - points[i - 1].s_m);
  const Vec2 a = points[i - 1].position_m.xy(), b = points[i].position_m.xy();
  return {a + (b - a) * share, points[i - 1].heading_rad};
}

/// Chevrons along the lane, at a spacing that suits the scale.
void paint_arrows(GroundPen& pen, const RoadMap& map, const Lane& lane) {
  const double spacing_m = pen.at_least(12, 70), size_m = pen.at_least(0.7, 2.5);
  const auto count = static_cast<int>(std::max(1.0, lane.length_m / spacing_m));
  cairo_set_line_width(pen.context(), pen.at_least(0.18, 0.8));
  pen.canvas().set_color(hex(0xFFFFFF), 0.45);
  for (int i = 0; i < count; ++i) {
    const float s_m = lane.length_m * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    const LanePose pose = pose_at(map.points_of(lane), s_m);
    if (!pen.is_visible(pose.position_m, 1)) continue;
    const Vec2 ahead = direction(pose.heading_rad) * static_cast<float>(size_m), left = left_normal(ahead);
    pen.move_to(pose.position_m - ahead * 0.6f + left);
    pen.line_to(pose.position_m + ahead * 0.6f);
    pen.line_to(pose.position_m - ahead * 0.6f - left);
    cairo_stroke(pen.context());
  }
}

void paint_lane_number(GroundPen& pen, const RoadMap& map, size_t index) {
  const Lane& lane = map.lanes[index];
  // Before the arrow in the middle, if there is one.
  const LanePose pose = pose_at(map.points_of(lane), 0.5f * lane.length_m);
  const Vec2 position = pose.position_m - direction(pose.heading_rad) * static_cast<float>(14 / pen.px_per_m());
  if (!pen.is_visible(position, 1)) return;
  const bool on_dark = is_drivable(lane.type);
  pen.label(position, fmt::format("{}", index),
            {.size_px = 9, .align = Align::center, .color = on_dark ? hex(0xE6E9ED) : hex(0x5A6068)});
}

/// The line, shaded on the side of its buildings.
void paint_building_line(GroundPen& pen, const BuildingLine& line) {
  const Vec2 a = line.a_m.xy(), b = line.b_m.xy();
  const Vec2 along = b - a;
  if (length(along) == 0 || !pen.is_visible((a + b) * 0.5f, length(along))) return;
  const auto depth_m = static_cast<float>(pen.at_least(1.2, 3));
  const Vec2 back = left_normal(along * (1 / length(along))) * (0.5f * depth_m);
  pen.line(a + back, b + back, depth_m, kBuildingLineInk, 0.25);
  pen.line(a, b, pen.at_least(0.2, 1), kBuildingLineInk);
}

/// The angle within which the head is visible, and a line to its stop line.
void paint_light_angle(GroundPen& pen, const TrafficLight& light) {
  const float half_angle = MapGeometryOptions{}.light_half_angle_rad;
  const double radius_m = pen.at_least(6, 14);
  const Vec2 head = light.head_m.xy();
  const double facing = std::atan2(light.head_facing.y, light.head_facing.x);
  const Rgb color = phase_color(light.phase);
  cairo_new_path(pen.context());
  pen.move_to(head);
  cairo_arc(pen.context(), head.x, head.y, radius_m, facing - half_angle, facing + half_angle);
  cairo_close_path(pen.context());
  pen.canvas().set_color(color, 0.22);
  cairo_fill_preserve(pen.context());
  pen.canvas().set_color(color, 0.8);
  cairo_set_line_width(pen.context(), pen.at_least(0.08, 0.6));
  cairo_stroke(pen.context());
  const double dash = pen.at_least(0.5, 3);
  cairo_set_dash(pen.context(), &dash, 1, 0);
  pen.line(head, (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f, pen.at_least(0.08, 0.6), color, 0.8);
  cairo_set_dash(pen.context(), nullptr, 0, 0);
}

/// A diamond with a tail towards the traffic that the sign addresses.
void paint_sign(GroundPen& pen, const Sign& sign) {
  const Vec2 position = sign.position_m.xy();
  const double radius_m = pen.at_least(0.7, 3);
  if (!pen.is_visible(position, static_cast<float>(3 * radius_m))) return;
  const Vec2 tail = position - direction(sign.heading_rad) * static_cast<float>(2.6 * radius_m);
  pen.line(position, tail, pen.at_least(0.15, 0.8), kSignInk);
  sign_path(pen.context(), position.x, position.y, radius_m);
  pen.canvas().set_color(kSignInk);
  cairo_fill_preserve(pen.context());
  pen.canvas().set_color(hex(0xFFFFFF));
  cairo_set_line_width(pen.context(), pen.at_least(0.1, 0.6));
  cairo_stroke(pen.context());
}

/// On the back of the light or sign, where nothing else of it is drawn.
void paint_name(GroundPen& pen, Vec2 position, Vec2 facing, const std::string& name, Rgb color) {
  if (!pen.is_visible(position, 1)) return;
  const Vec2 behind = position - facing * static_cast<float>(11 / pen.px_per_m());
  const Align align = facing.x > 0.4f ? Align::right : (facing.x < -0.4f ? Align::left : Align::center);
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

void paint_details(const RoadMap& map, Canvas& canvas, Vec2 left_top_m, double px_per_m) {
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
    paint_name(pen, sign.position_m.xy(), direction(sign.heading_rad) * -1, sign.type, kSignInk);
  }
  for (const TrafficLight& light : map.lights) {
    paint_name(pen, light.head_m.xy(), light.head_facing, light.name, hex(0x1E2126));
  }
}

}  // namespace pictura
