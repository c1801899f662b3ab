// Graph of a map's lanes. Edges lead to successors and neighbours.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Position on a lane's centre line, measured from the lane's start.
struct LanePosition {
  int32_t lane = -1;
  float s_m = 0;
};

struct LaneRoute {
  std::vector<int32_t> lanes;  // a lane change appends the new lane
  double length_m = 0;
  int32_t lane_changes = 0;
  double cost_m = 0;  // length_m plus the cost of the lane changes
};

/// Strongly connected components.
struct LaneComponents {
  int32_t count = 0;
  std::vector<int32_t> of_lane;  // [lanes] in [0, count); edges never lead to a higher component
};

/// Lane graph, independent of the map after construction. A lane change has a fixed cost, and keeps the position as a
/// fraction of the lane's length. Routes change lanes only at their start and at starts of lanes. Other changes would
/// reach no more lanes, because neighbours begin and end together.
class LaneGraph {
 public:
  /// Throws Error if the cost is negative or not finite. The map must be validated.
  explicit LaneGraph(const RoadMap& map, double lane_change_cost_m = 0);

  int32_t num_lanes() const { return static_cast<int32_t>(length_m_.size()); }
  float length_m(int32_t lane) const { return length_m_[lane]; }

  /// Returns the cheapest route, if there is one. If `to` is behind `from` on the same lane, the route is a loop.
  /// Throws Error for an unknown lane, or an s_m outside the lane.
  std::optional<LaneRoute> route(LanePosition from, LanePosition to) const;

  /// Returns the minimum costs in metres to the starts of all lanes; infinite without a route. Throws as route() does.
  std::vector<double> distances_from(LanePosition from) const;

  /// Returns whether each lane is reachable from the start of `lane`.
  std::vector<bool> reachable_from(int32_t lane) const;

  /// Uses Tarjan's algorithm (Depth-first search and linear graph algorithms, 1972).
  LaneComponents components() const;

 private:
  struct Edge {
    int32_t lane = 0;
    bool is_change = false;
  };
  /// Search over nodes. Node n < num_lanes() is the start of lane n. Node num_lanes() + n is the point of lane n at
  /// begin_fraction of the lane's length.
  struct Search {
    double begin_fraction = 0;            // start position relative to its lane's length
    std::vector<double> cost_m;           // [nodes]
    std::vector<int32_t> previous;        // [nodes] or -1
    std::vector<uint8_t> is_lane_change;  // [nodes] whether a lane change leads to the node
  };

  Span<const Edge> edges_of(int32_t lane) const;
  void check(LanePosition position) const;
  int32_t lane_of(int32_t node) const { return node < num_lanes() ? node : node - num_lanes(); }
  double distance_to_end_m(int32_t node, double begin_fraction) const;
  Search search(LanePosition from) const;

  double lane_change_cost_m_ = 0;
  std::vector<float> length_m_;      // [lanes]
  std::vector<int32_t> edge_begin_;  // [lanes + 1]
  std::vector<Edge> edges_;
};

}  // namespace pictura
