// Map data that rules read: flat arrays and cell lists (grids with a list of items for each cell), in host or device
// memory. simulator/map_rules.h makes them from a RoadMap. There are two kinds of cell lists. A list of `*_cells`
// contains all items within reach of any point in the cell, so that a query at a point reads one cell. A list of
// `near_*` contains the items that an agent in the cell may observe, nearest to the cell's centre first.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/color.h"
#include "pictura/common/math.h"
#include "pictura/common/span.h"
#include "pictura/map/scenario/road_side.h"

namespace pictura {

/// An agent is on a lane only within this distance of the lane's centre line.
constexpr float kLaneReach_m = 5.0f;
/// Two objects are on the same level if their heights differ by less than this.
constexpr float kLevel_m = 2.0f;
/// An agent can violate a stop line only within this distance of the line's middle.
constexpr float kStopLineReach_m = 10.0f;

/// A straight piece of a drivable lane's centre line, in the direction of travel.
struct LaneSegment {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;        // rise per metre
  float heading_rad = 0;  // heading of the lane at a
  float turn_rad = 0;     // heading at the end minus heading at a
  float half_width_m = 0;
  float s_m = 0;          // arc length at a
  int32_t lane = 0;       // index into MapView::lanes
  int32_t is_driven = 0;  // 1: agents can be on its lane; 0: only part of the drivable surface (parking)
};

/// Value of MapLane::route_end_m for lanes after which routes continue.
constexpr float kRouteGoesOn_m = 1e30f;

struct MapLane {
  int32_t first_segment = 0, num_segments = 0;
  // Range of MapView::successors. The first num_successors lanes are those on which a route may continue: lanes on
  // which routes can continue without end or, on open maps, driving and ramp lanes. The other successors follow.
  int32_t first_successor = 0, num_successors = 0, num_all_successors = 0;
  int32_t left = -1, right = -1;  // neighbouring lanes on which a route may continue, or -1
  float length_m = 0;
  float speed_limit_mps = 0;
  int32_t light = -1;                  // index of the stop line that controls the lane, or -1
  float route_end_m = kRouteGoesOn_m;  // if routes end on this lane: arc length of their end
};

/// Place where agents leave an open map: a line across the end of a lane.
struct Exit {
  Vec3 middle_m;
  Vec2 direction;  // direction of traffic, unit vector
  float half_width_m = 0;
  float slope = 0;  // slope of the lane at its end, rise per metre
};

/// A lane at whose start agents enter an open map. Entries that are close to each other have the same `turn`: in each
/// step, only one agent can enter through them.
struct Entry {
  int32_t lane = 0, turn = 0;
};

/// A straight piece of the drivable surface's outline, or the lower edge of a wall.
struct Barrier {
  Vec2 a_m, b_m;
  float z_m = 0;  // at its middle
};

/// A straight, directed piece of a walkway. Pieces 2k and 2k + 1 are the two directions of one line.
struct WalkPiece {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;  // rise per metre
  float heading_rad = 0;
  int32_t to_node = 0;  // node at its end
  int32_t next = 0;     // the following piece (at a dead end, the way back); -1: there are several
};
/// Returns the height of a LaneSegment or a WalkPiece at distance along_m from its start.
template <typename Piece>
PICTURA_HD float height_on(const Piece& piece, float along_m) {
  return piece.a_m.z + piece.slope * along_m;
}

/// Within this distance of a walkway, a pedestrian stands at the walkway's height.
constexpr float kWalkReach_m = 5.0f;

struct StopLine {
  Vec3 left_m, right_m;
  Vec3 middle_m;
  Vec2 direction;  // direction of the controlled traffic
  float half_length_m = 0;
  float beyond_left_m = 0, beyond_right_m = 0;  // distances from its ends to the far side of adjacent oncoming lanes
  int32_t junction = -1, phase = 0, num_phases = 1;
};

/// A place for a parked car. Either the car's centre is at position_m, or position_m is on a kerb and the car parks
/// outside this kerb.
struct ParkingSpot {
  Vec3 position_m;
  float heading_rad = 0;
  Vec2 outward;  // at a kerb: unit vector away from the road; elsewhere 0
};

/// A piece of a lane, boundary or wall that the policy observes. MapOptions::observed_span_m sets its maximum length.
/// It has eight floats, which a CPU loads with one instruction and a GPU with two.
struct alignas(16) ObservedPiece {
  Vec3 middle_m;  // on the ground
  float half_length_m = 0;
  Vec2 direction;
  float extent = 0;  // a lane's width or a wall's height, scaled for observation; 0 for boundaries
  float zero = 0;
};
static_assert(sizeof(ObservedPiece) == 8 * sizeof(float));

/// A road user of the recorded scene of a map.
struct RecordedAgent {
  int32_t agent_class = 0;  // AgentClass
  float length_m = 0, width_m = 0, height_m = 0;
  Vec3 goal_m;  // reference point at the end of its record
};

/// State of a recorded agent at one step.
struct RecordedState {
  Vec3 position_m;  // position of the reference point
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
  int32_t is_present = 0;
};

struct MapView {
  Span<const LaneSegment> segments;
  Span<const MapLane> lanes;
  Span<const int32_t> successors;
  Span<const Barrier> edges, walls;
  Span<const StopLine> stop_lines;
  Span<const int32_t> spawn_lanes;
  Span<const float> spawn_end_m;  // [spawn_lanes] running sum of lengths; on open maps, only of parts far from the ends
                                  // of routes
  Span<const Exit> exits;
  Span<const Entry> entries;
  GridView exit_cells;
  Span<const WalkPiece> walk_pieces;
  Span<const float> walk_end_m;          // [walk_pieces] running sum of lengths
  Span<const int32_t> walk_leave_begin;  // [walk nodes + 1] into walk_leaving: the pieces that leave a node
  Span<const int32_t> walk_leaving;
  Span<const ParkingSpot> parking_spots;
  Span<const ObservedPiece> lane_pieces, boundary_pieces, wall_pieces;
  Span<const Vec2> lane_middles, boundary_middles, wall_middles;  // x, y of the pieces' middle_m
  GridView segment_cells, edge_cells, wall_cells, stop_line_cells;
  GridView walk_cells;                                                // item k is the pair of walk_pieces 2k, 2k + 1
  GridView near_lane_pieces, near_boundary_pieces, near_wall_pieces;  // lists per cell and heading sector
  GridView near_stop_lines;
  Span<const RecordedAgent> recorded_agents;  // in the order of the worlds' agents; empty without a record
  Span<const RecordedState> recorded_states;  // [recorded_agents, recorded_steps]
  Span<const SideEdge> side_edges;            // only on maps with a record, for road_side()
  GridView side_cells;
  Span<const LightState> recorded_lights;  // [stop_lines, recorded_steps]; if empty, lights follow LightPlans
  int32_t recorded_steps = 0;              // number of recorded steps from the start of episodes on
  // If above 0, recorded_agents from this index on are replayed tracks: boxes like parked cars, not agents.
  int32_t first_replayed = 0;
  float max_box_radius_m = 0, max_speed_mps = 0;  // maximum half-diagonal of boxes, and maximum speed
  uint8_t is_open = 0;                            // 1: roads end, so that agents leave and enter
};

/// Whether the map comes from a recorded scene. Its worlds then contain the scene's road users.
PICTURA_HD inline bool has_record(const MapView& map) { return !map.recorded_agents.empty(); }

/// Whether some road users of the scene are replayed tracks: they follow their records as boxes like parked cars, not
/// as agents.
PICTURA_HD inline bool has_replayed_tracks(const MapView& map) { return map.first_replayed > 0; }

/// Calls visit(&span) for every array of the view, for instance to copy the arrays to device memory.
template <typename Visit>
PICTURA_HD void visit_arrays(MapView* view, Visit&& visit) {
  visit(&view->segments);
  visit(&view->lanes);
  visit(&view->successors);
  visit(&view->edges);
  visit(&view->walls);
  visit(&view->stop_lines);
  visit(&view->spawn_lanes);
  visit(&view->spawn_end_m);
  visit(&view->exits);
  visit(&view->entries);
  visit(&view->walk_pieces);
  visit(&view->walk_end_m);
  visit(&view->walk_leave_begin);
  visit(&view->walk_leaving);
  visit(&view->parking_spots);
  visit(&view->lane_pieces);
  visit(&view->boundary_pieces);
  visit(&view->wall_pieces);
  visit(&view->lane_middles);
  visit(&view->boundary_middles);
  visit(&view->wall_middles);
  visit(&view->recorded_agents);
  visit(&view->recorded_states);
  visit(&view->recorded_lights);
  visit(&view->side_edges);
  GridView* const lists[] = {&view->segment_cells,        &view->edge_cells,       &view->wall_cells,
                             &view->stop_line_cells,      &view->walk_cells,       &view->near_lane_pieces,
                             &view->near_boundary_pieces, &view->near_wall_pieces, &view->near_stop_lines,
                             &view->side_cells,           &view->exit_cells};
  for (GridView* cells : lists) {
    visit(&cells->begin);
    visit(&cells->items);
  }
}

PICTURA_HD inline Span<const int32_t> list_of(const GridView& lists, size_t index) {
  const int32_t begin = lists.begin[index];
  return lists.items.subspan(begin, lists.begin[index + 1] - begin);
}

/// Returns the list of the cell that contains p. Points outside the grid belong to the nearest cell.
PICTURA_HD inline Span<const int32_t> items_at(const GridView& cells, Vec2 p) {
  return list_of(cells, static_cast<size_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x)));
}

/// Number of heading sectors. Because the visible pieces depend on the observer's heading, there is a list of pieces
/// for each cell and each sector of 45 degrees.
constexpr int kSectors = 8;

/// Cell and heading sector of an observer. All near_* lists have the same cells.
struct NearPlace {
  size_t cell = 0, sector = 0;
  PICTURA_HD size_t cell_and_sector() const { return cell * kSectors + sector; }
};

/// Returns the cell that contains p and the sector that contains the heading. heading_rad must be in [-pi, pi].
PICTURA_HD inline NearPlace near_place(const MapView& map, Vec2 p, float heading_rad) {
  const GridView& cells = map.near_lane_pieces;
  const int sector = clamp(static_cast<int>((heading_rad + kPi) * (kSectors / kTwoPi)), 0, kSectors - 1);
  return {static_cast<size_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x)), static_cast<size_t>(sector)};
}

}  // namespace pictura
