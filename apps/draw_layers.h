// The still parts of a map from above, painted onto a canvas: shared by the picture of a map and by films of a world.
// Private to the drawing library.
#pragma once

#include <vector>

#include "pictura/apps/draw_canvas.h"
#include "pictura/common/grid.h"
#include "pictura/map/road_map.h"

namespace pictura {

constexpr Rgb kGroundColor = hex(0xEEF0E8);

/// Bounding box of everything that is drawn of a map. Throws Error when there is nothing.
Aabb2 bounds_of(const RoadMap& map);

/// Colour of a lane's surface from above.
Rgb lane_color(LaneType type);

/// Colours of a junction's phases, as stop lines and heads show them where no state is known.
Rgb phase_color(int phase);

/// Paints lanes, parking spaces, crosswalks, markings and road edges, without lights.
class MapLayers {
 public:
  explicit MapLayers(const RoadMap& map);

  /// The top left pixel of the canvas shows left_top_m; only what touches the canvas is painted.
  void paint(Canvas& canvas, Vec2 left_top_m, double px_per_m) const;

 private:
  const RoadMap& map_;
  std::vector<int32_t> lanes_in_order_;  // those drawn first come first
  std::vector<Aabb2> lane_boxes_;        // [lanes]
  std::vector<Aabb2> marking_boxes_;     // [markings]
};

/// A light's stop line and head: the line in `color`, the head as a disk with a beak towards those it is meant for.
void paint_light(Canvas& canvas, const TrafficLight& light, Vec2 left_top_m, double px_per_m, Rgb color);

}  // namespace pictura
