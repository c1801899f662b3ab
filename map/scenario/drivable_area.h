// Drivable area of a map according to its road edges: a position is on the road if it is on the road's side of the
// nearest edge. Recorded maps need this rule, because their lanes do not determine the extent of the road.
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

/// Edges of a map for road_side(), and the grid cells that they touch.
struct SideEdges {
  std::vector<SideEdge> edges;  // in the order of RoadMap::road_edges
  Grid cells;
};
SideEdges side_edges_of(const RoadMap& map);

/// Drivable area of a map, with its own copy of the map data that it needs.
class DrivableArea {
 public:
  explicit DrivableArea(const RoadMap& map) : sides_(side_edges_of(map)) {}

  RoadSide side_of(Vec3 position_m) const { return road_side(sides_.edges, sides_.cells.view(), position_m); }

  /// Whether an edge crosses the box or is inside it. Only edges that differ in height from the box by less than 2 m
  /// count.
  bool touches_edge(const GroundBox& box) const;

 private:
  SideEdges sides_;
};

/// Agreement of recorded traffic with the map's edges, counted over the steps of moving vehicles.
struct LoggedDriving {
  // Valid steps at 0.5 m/s or more, of vehicles whose track moves (is_moving()).
  int64_t vehicle_steps = 0;
  int64_t touching = 0;  // vehicle steps in which the box touches an edge
  int64_t off_road = 0;  // vehicle steps in which the box's centre is not on the road
};
LoggedDriving logged_driving(const Scenario& scenario);

}  // namespace pictura
