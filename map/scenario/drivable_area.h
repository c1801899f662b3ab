// The drivable area of a map that says only where its edges are: a place is on the road if it is on the drivable side
// of the edge that is nearest. For logged maps, whose lanes do not say how far the road goes.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/grid.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/road_side.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// A box on the ground.
struct GroundBox {
  Vec3 center_m;
  float heading_rad = 0;
  float length_m = 0, width_m = 0;
};

/// The edges of a map, for road_side(), and the cells that they touch.
struct SideEdges {
  std::vector<SideEdge> edges;  // as RoadMap::road_edges
  Grid cells;
};
SideEdges side_edges_of(const RoadMap& map);

/// Copies what it needs of the map.
class DrivableArea {
 public:
  explicit DrivableArea(const RoadMap& map) : sides_(side_edges_of(map)) {}

  RoadSide side_of(Vec3 position_m) const { return road_side(sides_.edges, sides_.cells.view(), position_m); }

  /// Whether an edge on the box's level (heights within 2 m) is inside the box or crosses it.
  bool touches_edge(const GroundBox& box) const;

 private:
  SideEdges sides_;
};

/// How well logged traffic and the map's edges agree: over the steps of vehicles that move.
struct LoggedDriving {
  int64_t vehicle_steps = 0;  // valid steps at 0.5 m/s or more of vehicles whose tracks are moving (is_moving())
  int64_t touching = 0;       // of these, the box touches an edge
  int64_t off_road = 0;       // of these, the box's centre is not on the road
};
LoggedDriving logged_driving(const Scenario& scenario);

}  // namespace pictura
