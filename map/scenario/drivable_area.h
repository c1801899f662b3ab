// Drivable area of a map according to its road edges. Recorded maps need it, because their lanes do not cover the road.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/grid.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/road_side.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

struct GroundBox {
  Vec3 center_m;
  float heading_rad = 0;
  float length_m = 0, width_m = 0;
};

/// Edges of a map for road_side(), in a grid.
struct SideEdges {
  std::vector<SideEdge> edges;  // in the order of RoadMap::road_edges
  Grid cells;
};
SideEdges side_edges_of(const RoadMap& map);

/// Drivable area of a map, independent of the map after construction.
class DrivableArea {
 public:
  explicit DrivableArea(const RoadMap& map) : sides_(side_edges_of(map)) {}

  RoadSide side_of(Vec3 position_m) const { return road_side(sides_.edges, sides_.cells.view(), position_m); }

  /// Whether an edge crosses the box or is inside it, at a height difference of less than 2 m.
  bool touches_edge(const GroundBox& box) const;

 private:
  SideEdges sides_;
};

/// Agreement of recorded traffic with the map's edges, counted over steps of moving vehicles.
struct LoggedDriving {
  // Valid steps at 0.5 m/s or more, of vehicles for which is_moving() is true.
  int64_t vehicle_steps = 0;
  int64_t touching = 0;  // vehicle steps in which the box touches an edge
  int64_t off_road = 0;  // vehicle steps in which the box's centre is off the road
};
LoggedDriving logged_driving(const Scenario& scenario);

}  // namespace pictura
