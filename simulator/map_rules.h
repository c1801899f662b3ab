// A RoadMap flattened into the data that the rules of the simulation read. All worlds on a map share them.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/walkways.h"

namespace pictura {

/// Grid with a list of items per cell.
struct CellLists {
  Vec2 origin_m;
  float cell_m = 1;
  int num_x = 1, num_y = 1;
  std::vector<int32_t> begin{0, 0};
  std::vector<int32_t> items;

  GridView view() const { return {origin_m, cell_m, num_x, num_y, begin, items}; }
};

/// Recorded tracks and lights; empty without a recorded scene.
struct MapRecord {
  std::vector<RecordedAgent> agents;
  std::vector<RecordedState> states;     // [agents, steps]
  std::vector<LightState> light_states;  // [lights of the map, steps], or empty
  int32_t num_steps = 0;
  int32_t first_replayed = 0;  // see MapView
  float dt_s = 0.1f;

  const RecordedState& state(size_t agent, int32_t step) const {
    return states[agent * static_cast<size_t>(num_steps) + static_cast<size_t>(step)];
  }
  /// First episode step with a recorded state; -1: none.
  int32_t first_step(size_t agent) const;
};

struct MapRules {
  std::vector<LaneSegment> segments;
  std::vector<MapLane> lanes;  // in RoadMap order; without segments if not drivable
  std::vector<int32_t> successors;
  std::vector<Barrier> edges, walls;
  std::vector<StopLine> stop_lines;  // in the order of RoadMap::lights
  std::vector<int32_t> spawn_lanes;
  std::vector<float> spawn_end_m;
  std::vector<Exit> exits;
  std::vector<Entry> entries;
  Walkways walkways;
  std::vector<ParkingSpot> parking_spots;
  std::vector<ObservedPiece> lane_pieces, boundary_pieces, wall_pieces;
  std::vector<Vec2> lane_middles, boundary_middles, wall_middles;
  Grid segment_cells, edge_cells, wall_cells, stop_line_cells, walk_cells, exit_cells;
  CellLists near_lane_pieces, near_boundary_pieces, near_wall_pieces, near_stop_lines;
  Vec2 low_m, high_m;
  MapRecord record;
  SideEdges sides;  // only with a record
  float max_box_radius_m = 0, max_speed_mps = 0;
  bool is_open = false;

  MapView view() const;
  /// Memory for all arrays of the view, each aligned to kMapAlignment_bytes.
  int64_t size_bytes() const;
};
constexpr size_t kMapAlignment_bytes = 256;

/// Throws Error, which names the map, if it has no drivable lane. For observed_span_m see MapOptions.
MapRules make_map_rules(const RoadMap& map, Span<const WallFace> walls, bool observe_walls = false,
                        MapRecord record = {}, float observed_span_m = 0);

}  // namespace pictura
