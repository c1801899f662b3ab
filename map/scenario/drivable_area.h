// The drivable area of a map that says only where its edges are: a place is on the road if it is on the drivable side
// of the edge that is nearest. For logged maps, whose lanes do not say how far the road goes.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// A box on the ground.
struct GroundBox {
  Vec3 center_m;
  float heading_rad = 0;
  float length_m = 0, width_m = 0;
};

/// Copies what it needs of the map. Of two edges that meet, the one is asked in whose direction the place lies: at a
/// corner the side is that of the sum of both unit normals, which is right for any angle between them (Baerentzen and
/// Aanaes, Signed distance computation using the angle weighted pseudonormal, 2005). Heights count threefold, so that
/// the edges of a bridge are not nearest to what passes under it.
class DrivableArea {
 public:
  explicit DrivableArea(const RoadMap& map);

  struct Side {
    int32_t edge = -1;       // the nearest one of RoadMap::road_edges; -1: none within kReach_m
    float distance_m = 0;    // to it, heights threefold
    bool is_on_road = true;  // also where there is no edge
  };
  static constexpr float kReach_m = 50.0f;
  Side side_of(Vec3 position_m) const;

  /// Whether an edge on the box's level (heights within 2 m) is inside the box or crosses it.
  bool touches_edge(const GroundBox& box) const;

 private:
  struct Edge {
    Vec3 a_m, b_m;
    Vec2 left;                       // unit normal, away from the road
    int32_t before = -1, next = -1;  // the edges that meet it at its ends
  };
  std::vector<Edge> edges_;
  Grid grid_;
};

/// How well logged traffic and the map's edges agree: over the steps of vehicles that move.
struct LoggedDriving {
  int64_t vehicle_steps = 0;  // valid steps at 0.5 m/s or more of vehicles whose tracks are moving (is_moving())
  int64_t touching = 0;       // of these, the box touches an edge
  int64_t off_road = 0;       // of these, the box's centre is not on the road
};
LoggedDriving logged_driving(const Scenario& scenario);

}  // namespace pictura
