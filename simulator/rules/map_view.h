// What rules read of a map: flat arrays and cell lists that both devices can hold. simulator/map_rules.h makes them
// from a RoadMap. Cell lists come in two kinds: `*_cells` list, for a point's one cell, everything within reach of any
// point in it; `near_*` list what may be observed from it, nearest to the cell's centre first.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/color.h"
#include "pictura/common/math.h"
#include "pictura/common/span.h"
#include "pictura/map/scenario/road_side.h"

namespace pictura {

/// How far from a lane's centre line an agent still counts as being on that lane.
constexpr float kLaneReach_m = 5.0f;
/// Two places whose heights differ by less are on the same level.
constexpr float kLevel_m = 2.0f;
/// Within which a stop line can be violated.
constexpr float kStopLineReach_m = 10.0f;

/// A straight piece of a drivable lane's centre line, in the direction of travel.
struct LaneSegment {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;        // rise per metre
  float heading_rad = 0;  // of the lane at a
  float turn_rad = 0;     // heading at the end less heading at a
  float half_width_m = 0;
  float s_m = 0;          // arc length of a
  int32_t lane = 0;       // index into MapView::lanes
  int32_t is_driven = 0;  // agents associate with its lane; else it is only part of the drivable surface (parking)
};

/// MapLane::route_end_m where routes go on after the lane.
constexpr float kRouteGoesOn_m = 1e30f;

struct MapLane {
  int32_t first_segment = 0, num_segments = 0;
  // Of MapView::successors: first those from which a route goes on for ever, or on open maps along driving and ramp
  // lanes, num_successors of them, then the others.
  int32_t first_successor = 0, num_successors = 0, num_all_successors = 0;
  int32_t left = -1, right = -1;  // neighbours from which routes go on in that way
  float length_m = 0;
  float speed_limit_mps = 0;
  int32_t light = -1;                  // the stop line that holds it
  float route_end_m = kRouteGoesOn_m;  // on open maps, how far along it waypoints lie where routes end
};

/// Where agents leave an open map: a line across the end of a lane.
struct Exit {
  Vec3 middle_m;
  Vec2 direction;  // of traffic, unit vector
  float half_width_m = 0;
  float slope = 0;  // of the lane there, rise per metre
};

/// A lane at whose start agents enter an open map. Of the entries of one turn one agent enters in a step.
struct Entry {
  int32_t lane = 0, turn = 0;
};

/// A piece of the drivable surface's outline, or the foot of a wall.
struct Barrier {
  Vec2 a_m, b_m;
  float z_m = 0;  // at its middle
};

/// A straight piece of a way for pedestrians, in one direction; the one of the other direction has the index next to
/// it: 2k and 2k + 1.
struct WalkPiece {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;  // rise per metre
  float heading_rad = 0;
  int32_t to_node = 0;  // where it ends
  int32_t next = 0;     // the only piece to go on to, which at a dead end is the way back; -1: several
};
/// The height of a LaneSegment or a WalkPiece, along_m from its start.
template <typename Piece>
PICTURA_HD float height_on(const Piece& piece, float along_m) {
  return piece.a_m.z + piece.slope * along_m;
}

/// How far from a walkway a pedestrian still stands at its height.
constexpr float kWalkReach_m = 5.0f;

struct StopLine {
  Vec3 left_m, right_m;
  Vec3 middle_m;
  Vec2 direction;  // of the traffic that it stops
  float half_length_m = 0;
  float beyond_left_m = 0, beyond_right_m = 0;  // from its ends to the far side of the lanes of oncoming traffic
  int32_t junction = -1, phase = 0, num_phases = 1;
};

/// Where a car may be parked: on the spot, or outside a kerb that runs through it.
struct ParkingSpot {
  Vec3 position_m;
  float heading_rad = 0;
  Vec2 outward;  // unit vector away from the road; null on parking lanes and spaces
};

/// A piece of a lane, boundary or wall as the policy sees it: as long as MapOptions says. Eight floats, which
/// a host reads in one load and a device in two.
struct alignas(16) ObservedPiece {
  Vec3 middle_m;  // on the ground
  float half_length_m = 0;
  Vec2 direction;
  float extent = 0;  // a lane's width or a wall's height, scaled as it is observed; a boundary has none
  float zero = 0;
};
static_assert(sizeof(ObservedPiece) == 8 * sizeof(float));

/// A road user of the scene that a map was recorded with.
struct RecordedAgent {
  int32_t agent_class = 0;  // AgentClass
  float length_m = 0, width_m = 0, height_m = 0;
  Vec3 goal_m;  // its reference point at the end of its record
};

/// Where it is at one step.
struct RecordedState {
  Vec3 position_m;  // its reference point
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
  int32_t is_there = 0;
};

struct MapView {
  Span<const LaneSegment> segments;
  Span<const MapLane> lanes;
  Span<const int32_t> successors;
  Span<const Barrier> edges, walls;
  Span<const StopLine> stop_lines;
  Span<const int32_t> spawn_lanes;
  Span<const float> spawn_end_m;  // [spawn_lanes] running sum of their lengths; on open maps, with way enough ahead
  Span<const Exit> exits;
  Span<const Entry> entries;
  GridView exit_cells;
  Span<const WalkPiece> walk_pieces;
  Span<const float> walk_end_m;          // [walk_pieces] running sum of their lengths
  Span<const int32_t> walk_leave_begin;  // [walk nodes + 1] of walk_leaving: the pieces that leave a node
  Span<const int32_t> walk_leaving;
  Span<const ParkingSpot> parking_spots;
  Span<const ObservedPiece> lane_pieces, boundary_pieces, wall_pieces;
  Span<const Vec2> lane_middles, boundary_middles, wall_middles;  // of those pieces, again: a quarter of the bytes
  GridView segment_cells, edge_cells, wall_cells, stop_line_cells;
  GridView walk_cells;                                                // of pairs of walk_pieces
  GridView near_lane_pieces, near_boundary_pieces, near_wall_pieces;  // per cell and sector
  GridView near_stop_lines;
  Span<const RecordedAgent> recorded_agents;  // of the scene, in the order of its worlds' agents; or none
  Span<const RecordedState> recorded_states;  // [recorded_agents, recorded_steps]
  Span<const SideEdge> side_edges;            // of maps with a record: on which side of them the road is
  GridView side_cells;
  Span<const LightState> recorded_lights;         // [stop_lines, recorded_steps]; or none, and lights run by plans
  int32_t recorded_steps = 0;                     // the first one is where episodes start
  float max_box_radius_m = 0, max_speed_mps = 0;  // no box has a longer half-diagonal, and nothing is faster
  uint8_t is_open = 0;                            // roads end, and agents leave and enter
};

/// Whether the map comes from a recorded scene: all agents of its worlds are the scene's.
PICTURA_HD inline bool has_record(const MapView& map) { return !map.recorded_agents.empty(); }

/// Calls visit(&span) for every array of the view, so that they can be copied to another memory.
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

/// The list of the cell that holds p; points outside belong to the nearest cell.
PICTURA_HD inline Span<const int32_t> items_at(const GridView& cells, Vec2 p) {
  return list_of(cells, static_cast<size_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x)));
}

/// What there is to observe depends on the heading: pieces are listed per cell and per eighth of a turn.
constexpr int kSectors = 8;

/// The cell and the sector of an observer; the near_* lists all have the same cells.
struct NearPlace {
  size_t cell = 0, sector = 0;
  PICTURA_HD size_t cell_and_sector() const { return cell * kSectors + sector; }
};

/// The cell that holds p and the sector that holds the heading, in [-pi, pi].
PICTURA_HD inline NearPlace near_place(const MapView& map, Vec2 p, float heading_rad) {
  const GridView& cells = map.near_lane_pieces;
  const int sector = clamp(static_cast<int>((heading_rad + kPi) * (kSectors / kTwoPi)), 0, kSectors - 1);
  return {static_cast<size_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x)), static_cast<size_t>(sector)};
}

}  // namespace pictura
