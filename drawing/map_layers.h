// Static parts of a map from above. Private to the drawing library.
#pragma once

#include <vector>

#include "pictura/common/grid.h"
#include "pictura/drawing/canvas.h"
#include "pictura/drawing/plan.h"
#include "pictura/map/road_map.h"

namespace pictura {

constexpr Rgb kGroundColor = hex(0xEEF0E8);
constexpr Rgb kRoadEdgeInk = hex(0xC8312F);
constexpr Rgb kStopLineInk = hex(0xFFFFFF);
constexpr Rgb kParkingSpaceInk = hex(0xC9D2DE);

/// Bounding box of lanes, road edges, markings and parking spaces. Throws Error when the map has none of these.
Aabb2 bounds_of(const RoadMap& map);

Rgb lane_color(LaneType type);

Rgb paint_color(MarkColor color);

/// Colour of a phase, for stop lines and heads without a known state. A phase is the stop lines of a junction that are
/// green together.
Rgb phase_color(int phase);

/// Draws in map metres. The canvas's top left pixel is at left_top_m, and north is up. The destructor restores the
/// canvas's units.
class GroundPen {
 public:
  GroundPen(Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m);
  ~GroundPen();
  GroundPen(const GroundPen&) = delete;
  GroundPen& operator=(const GroundPen&) = delete;

  Canvas& canvas() { return canvas_; }
  cairo_t* context() { return canvas_.context(); }
  double px_per_m() const { return px_per_m_; }
  /// Returns the larger of both sizes, in metres.
  double at_least(double metres, double min_px) const;
  /// Whether the box touches the canvas.
  bool is_visible(const Aabb2& box) const;
  bool is_visible(const Eigen::Vector2d& position, double margin_m) const;

  void move_to(const Eigen::Vector2d& p) { cairo_move_to(context(), p.x(), p.y()); }
  void line_to(const Eigen::Vector2d& p) { cairo_line_to(context(), p.x(), p.y()); }
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double width_m, Rgb color, double alpha = 1);
  void disk(const Eigen::Vector2d& center, double radius_m, Rgb color, double alpha = 1);
  /// Draws text with a size in pixels.
  void label(const Eigen::Vector2d& position, const std::string& words, const TextStyle& style);

 private:
  Canvas& canvas_;
  Eigen::Affine2d to_pixels_;
  double px_per_m_;
  Aabb2 visible_;
};

/// Paints lanes, parking spaces, crosswalks, markings, stop lines and road edges, without lights.
class MapLayers {
 public:
  explicit MapLayers(const RoadMap& map);

  /// left_top_m: place of the canvas's top left pixel.
  void paint(Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m) const;

 private:
  void paint_lanes(GroundPen& pen) const;
  void paint_parking_spaces(GroundPen& pen) const;
  void paint_crosswalk(GroundPen& pen, const Crosswalk& crosswalk) const;
  void paint_markings(GroundPen& pen) const;
  void paint_road_edges(GroundPen& pen) const;

  const RoadMap& map_;
  std::vector<int32_t> lanes_in_order_;  // in drawing order
  std::vector<Aabb2> lane_boxes_;        // [lanes]
  std::vector<Aabb2> marking_boxes_;     // [markings]
};

/// Paints a stop line in `color`, and its light head as a disk with a pointer towards the traffic.
void paint_light(Canvas& canvas, const TrafficLight& light, const Eigen::Vector2d& left_top_m, double px_per_m,
                 Rgb color);

}  // namespace pictura
