// Map data that rules read, made by simulator/map_rules.h, in host or device memory. Cell lists are grids with a list
// of items per cell. A list of `*_cells` contains all items within reach of any point in the cell. A list of `near_*`
// contains the items that an agent in the cell may observe, nearest to the cell's centre first.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/color.h"
#include "pictura/common/math.h"
#include "pictura/common/span.h"
#include "pictura/map/scenario/road_side.h"

namespace pictura {

/// Maximum distance of an agent from its lane.
constexpr float kLaneReach_m = 5.0f;
/// Height difference below which objects are on the same level.
constexpr float kLevel_m = 2.0f;
/// Maximum distance of an agent from the middle of a stop line that it violates.
constexpr float kStopLineReach_m = 10.0f;

/// Straight piece of a drivable lane, in the direction of travel.
struct LaneSegment {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;        // rise per metre
  float heading_rad = 0;  // at a_m
  float turn_rad = 0;     // from a_m to the end
  float half_width_m = 0;
  float s_m = 0;          // at a_m
  int32_t lane = 0;       // in MapView::lanes
  int32_t is_driven = 0;  // 0: drivable surface without traffic (parking)
};

/// Value of MapLane::route_end_m if routes do not end on the lane.
constexpr float kRouteGoesOn_m = 1e30f;

struct MapLane {
  int32_t first_segment = 0, num_segments = 0;
  // Range of MapView::successors. Routes may continue on the first num_successors lanes. On open maps, these are
  // driving and ramp lanes; on other maps, lanes from which routes continue without end.
  int32_t first_successor = 0, num_successors = 0, num_all_successors = 0;
  int32_t left = -1, right = -1;  // neighbouring lanes for routes, or -1
  float length_m = 0;
  float speed_limit_mps = 0;
  int32_t light = -1;                  // stop line, or -1
  float route_end_m = kRouteGoesOn_m;  // arc length at which routes end
};

/// Line across the end of a lane, where agents leave an open map.
struct Exit {
  Vec3 middle_m;
  Vec2 direction;  // direction of traffic, unit vector
  float half_width_m = 0;
  float slope = 0;  // rise per metre
};

/// Lane at whose start agents enter an open map. Entries close to each other have the same `turn`; in each step, only
/// one agent can enter through them.
struct Entry {
  int32_t lane = 0, turn = 0;
};

/// Piece of the drivable surface's outline, or lower edge of a wall.
struct Barrier {
  Vec2 a_m, b_m;
  float z_m = 0;  // at its middle
};

/// Directed piece of a walkway. Pieces 2k and 2k + 1 are opposite directions of one line.
struct WalkPiece {
  Vec3 a_m;
  Vec2 direction;  // unit vector
  float length_m = 0;
  float slope = 0;  // rise per metre
  float heading_rad = 0;
  int32_t to_node = 0;  // at its end
  int32_t next = 0;     // next piece (at a dead end, the way back); -1: several
};
/// Height at distance along_m from the start.
template <typename Piece>
PICTURA_HD float height_on(const Piece& piece, float along_m) {
  return piece.a_m.z + piece.slope * along_m;
}

/// Distance from a walkway within which a pedestrian has the walkway's height.
constexpr float kWalkReach_m = 5.0f;

struct StopLine {
  Vec3 left_m, right_m;
  Vec3 middle_m;
  Vec2 direction;  // direction of the controlled traffic
  float half_length_m = 0;
  float beyond_left_m = 0, beyond_right_m = 0;  // from each end to the far side of adjacent oncoming lanes
  int32_t junction = -1, phase = 0, num_phases = 1;
};

/// Place for a parked car: the car's centre or, at a kerb, a point of the kerb beside the car.
struct ParkingSpot {
  Vec3 position_m;
  float heading_rad = 0;
  Vec2 outward;  // at a kerb: unit vector off the road; elsewhere 0
};

/// Observed piece of a lane, boundary or wall. A CPU loads its eight floats with one instruction.
struct alignas(16) ObservedPiece {
  Vec3 middle_m;  // on the ground
  float half_length_m = 0;
  Vec2 direction;
  float extent = 0;  // scaled width of a lane or height of a wall; else 0
  float zero = 0;
};
static_assert(sizeof(ObservedPiece) == 8 * sizeof(float));

/// Road user of a recorded scene.
struct RecordedAgent {
  int32_t agent_class = 0;  // AgentClass
  float length_m = 0, width_m = 0, height_m = 0;
  Vec3 goal_m;  // end of its record
};

struct RecordedState {
  Vec3 position_m;  // reference point
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
  Span<const float> spawn_end_m;  // [spawn_lanes] running sum of lengths; on open maps, without parts near route ends
  Span<const Exit> exits;
  Span<const Entry> entries;
  GridView exit_cells;
  Span<const WalkPiece> walk_pieces;
  Span<const float> walk_end_m;          // [walk_pieces] running sum of lengths
  Span<const int32_t> walk_leave_begin;  // [walk nodes + 1] into walk_leaving
  Span<const int32_t> walk_leaving;
  Span<const ParkingSpot> parking_spots;
  Span<const ObservedPiece> lane_pieces, boundary_pieces, wall_pieces;
  Span<const Vec2> lane_middles, boundary_middles, wall_middles;  // x, y of middle_m
  GridView segment_cells, edge_cells, wall_cells, stop_line_cells;
  GridView walk_cells;                                                // item k: walk_pieces 2k, 2k + 1
  GridView near_lane_pieces, near_boundary_pieces, near_wall_pieces;  // per cell and heading sector
  GridView near_stop_lines;
  Span<const RecordedAgent> recorded_agents;  // in the order of the worlds' agents
  Span<const RecordedState> recorded_states;  // [recorded_agents, recorded_steps]
  Span<const SideEdge> side_edges;            // with a record, for road_side()
  GridView side_cells;
  Span<const LightState> recorded_lights;  // [stop_lines, recorded_steps]; if empty, LightPlans apply
  int32_t recorded_steps = 0;              // from the start of episodes
  // If above 0: recorded_agents from this index on are replayed tracks, whose boxes take the places of parked cars.
  int32_t first_replayed = 0;
  float max_box_radius_m = 0, max_speed_mps = 0;  // the radius is half the diagonal of a box
  uint8_t is_open = 0;                            // 1: an open map, whose roads end
};

/// Whether the map comes from a recorded scene.
PICTURA_HD inline bool has_record(const MapView& map) { return !map.recorded_agents.empty(); }

PICTURA_HD inline bool has_replayed_tracks(const MapView& map) { return map.first_replayed > 0; }

/// Calls visit(&span) for every array.
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

/// Returns the list of p's cell. Points outside the grid belong to the nearest cell.
PICTURA_HD inline Span<const int32_t> items_at(const GridView& cells, Vec2 p) {
  return list_of(cells, static_cast<size_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x)));
}

/// Sectors of 45 degrees. Each cell has a list per sector, because visible pieces depend on the heading.
constexpr int kSectors = 8;

/// Cell and heading sector of an observer, in one number to save registers.
struct NearPlace {
  uint32_t cell_and_sector = 0;
  PICTURA_HD uint32_t cell() const { return cell_and_sector / kSectors; }
};

/// heading_rad must be in [-pi, pi].
PICTURA_HD inline NearPlace near_place(const MapView& map, Vec2 p, float heading_rad) {
  const GridView& cells = map.near_lane_pieces;
  const int sector = clamp(static_cast<int>((heading_rad + kPi) * (kSectors / kTwoPi)), 0, kSectors - 1);
  const auto cell = static_cast<uint32_t>(cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x));
  return {cell * kSectors + static_cast<uint32_t>(sector)};
}

}  // namespace pictura
