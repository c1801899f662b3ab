// Graph of a map's lanes, for routes over several lanes. Nodes are lanes. Edges lead to successors, and to the
// neighbours that a lane change can reach.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// A position on a lane's centre line, `s_m` metres from the start of the lane.
struct LanePosition {
  int32_t lane = -1;
  float s_m = 0;
};

struct LaneRoute {
  std::vector<int32_t> lanes;  // in driving order; a lane change appends the new lane
  double length_m = 0;         // length along the lanes
  int32_t lane_changes = 0;
  double cost_m = 0;  // length_m plus the cost of the lane changes
};

/// Strongly connected components: each lane can reach all other lanes of its component.
struct LaneComponents {
  int32_t count = 0;
  std::vector<int32_t> of_lane;  // [lanes] in [0, count); edges never lead to a higher component
};

/// Lane graph, with its own copy of the map data that it needs. A lane change keeps the position as a fraction of the
/// lane's length, and has a fixed cost in metres. A route changes lanes only at its start and at starts of lanes.
/// Changes farther along a lane would reach no other lanes, because neighbours begin and end together.
class LaneGraph {
 public:
  /// Throws Error if the cost is negative or not finite. The map must be validated.
  explicit LaneGraph(const RoadMap& map, double lane_change_cost_m = 0);

  int32_t num_lanes() const { return static_cast<int32_t>(length_m_.size()); }
  float length_m(int32_t lane) const { return length_m_[lane]; }

  /// Returns the cheapest route, or nothing if there is none. If `to` is behind `from` on the same lane, the route is a
  /// loop. Throws Error for a lane that is not in the map, or an s_m outside the lane.
  std::optional<LaneRoute> route(LanePosition from, LanePosition to) const;

  /// Returns the minimum cost in metres from a position to the start of each lane, as [lanes]. The cost is infinite if
  /// there is no route. Throws as route() does.
  std::vector<double> distances_from(LanePosition from) const;

  /// Returns, as [lanes], whether a route leads from the start of `lane` to the start of each lane.
  std::vector<bool> reachable_from(int32_t lane) const;

  /// Returns the strongly connected components (Tarjan, Depth-first search and linear graph algorithms, 1972).
  LaneComponents components() const;

 private:
  struct Edge {
    int32_t lane = 0;
    bool is_change = false;
  };
  /// Result of a search from a start position. Node n < num_lanes() is the start of lane n. Node num_lanes() + n is the
  /// position on lane n beside the start position. Only lane changes at the start lead to such nodes.
  struct Search {
    double begin_fraction = 0;            // start position as a fraction of its lane's length
    std::vector<double> cost_m;           // [nodes] minimum costs
    std::vector<int32_t> previous;        // [nodes] the previous node on the path, or -1
    std::vector<uint8_t> is_lane_change;  // [nodes] whether the step from the previous node is a lane change
  };

  Span<const Edge> edges_of(int32_t lane) const;
  void check(LanePosition position) const;
  int32_t lane_of(int32_t node) const { return node < num_lanes() ? node : node - num_lanes(); }
  /// Distance from a node to the end of its lane.
  double distance_to_end_m(int32_t node, double begin_fraction) const;
  Search search(LanePosition from) const;

  double lane_change_cost_m_ = 0;
  std::vector<float> length_m_;      // [lanes]
  std::vector<int32_t> edge_begin_;  // [lanes + 1]
  std::vector<Edge> edges_;
};

}  // namespace pictura
