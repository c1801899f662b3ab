// The lanes of a map as a graph, for routes longer than a lane: nodes are lanes, edges lead to successors and to the
// neighbours that one may change to.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// A place on a lane's centre line, s_m from its start.
struct LanePlace {
  int32_t lane = -1;
  float s_m = 0;
};

struct LaneRoute {
  std::vector<int32_t> lanes;  // in the order in which they are driven; changing lanes adds the new one
  double length_m = 0;         // along the lanes
  int32_t lane_changes = 0;
  double cost_m = 0;  // length_m and the cost of the changes
};

/// Sets of lanes from each of which all others of its set can be reached.
struct LaneComponents {
  int32_t count = 0;
  std::vector<int32_t> of_lane;  // [lanes] in [0, count); no lane leads to one of a higher component
};

/// Keeps what it needs of the map. A lane change goes to a neighbour, at the same share of both lanes' lengths, and
/// costs as much as so many metres. It is made where a route or a lane begins: as neighbours begin and end side by
/// side, later changes lead nowhere else.
class LaneGraph {
 public:
  /// Throws Error unless the cost is finite and not negative. The map must be validated.
  explicit LaneGraph(const RoadMap& map, double lane_change_cost_m = 0);

  int32_t num_lanes() const { return static_cast<int32_t>(length_m_.size()); }

  /// The route of least cost, or nothing where none leads there. A place behind `from` on its lane is reached by going
  /// round. Throws Error for a lane that is not in the map, or an s_m beyond its ends.
  std::optional<LaneRoute> route(LanePlace from, LanePlace to) const;

  /// The least cost from a place to the beginning of each lane, [lanes]; infinite where no route leads there. Throws as
  /// route() does.
  std::vector<double> distances_from(LanePlace from) const;

  /// Whether some route leads from the beginning of a lane to that of each other, [lanes].
  std::vector<bool> reachable_from(int32_t lane) const;

  /// The strongly connected components (Tarjan, Depth-first search and linear graph algorithms, 1972).
  LaneComponents components() const;

 private:
  struct Edge {
    int32_t lane = 0;
    bool is_change = false;
  };
  /// Node n < lanes is the beginning of lane n; node lanes + n is the place on lane n beside the one where the search
  /// began.
  struct Search {
    double begin_share = 0;               // of the lane's length
    std::vector<double> cost_m;           // [nodes] least costs
    std::vector<int32_t> before;          // [nodes] the node before on the way, or -1
    std::vector<uint8_t> is_lane_change;  // [nodes] the step from there
  };

  Span<const Edge> edges_of(int32_t lane) const;
  void check(LanePlace place) const;
  int32_t lane_of(int32_t node) const { return node < num_lanes() ? node : node - num_lanes(); }
  /// From a node to the end of its lane.
  double to_end_m(int32_t node, double begin_share) const;
  Search search(LanePlace from) const;

  double lane_change_cost_m_ = 0;
  std::vector<float> length_m_;      // [lanes]
  std::vector<int32_t> edge_begin_;  // [lanes + 1]
  std::vector<Edge> edges_;
};

}  // namespace pictura
