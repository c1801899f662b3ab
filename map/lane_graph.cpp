#include "pictura/map/lane_graph.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Maximum distance of positions on a lane that count as equal, because of rounding.
constexpr double kSamePosition_m = 1e-3;

std::size_t at(int32_t index) { return static_cast<std::size_t>(index); }

}  // namespace

LaneGraph::LaneGraph(const RoadMap& map, double lane_change_cost_m) : lane_change_cost_m_(lane_change_cost_m) {
  PICTURA_CHECK(lane_change_cost_m >= 0 && std::isfinite(lane_change_cost_m),
                "lane graph: expected a lane-change cost of 0 m or more, got {}", lane_change_cost_m);
  edge_begin_.push_back(0);
  for (const Lane& lane : map.lanes) {
    length_m_.push_back(lane.length_m);
    for (const int32_t next : map.links(lane.successors)) edges_.push_back({next, false});
    for (const int32_t neighbor : {lane.left_neighbor, lane.right_neighbor}) {
      if (neighbor >= 0) edges_.push_back({neighbor, true});
    }
    edge_begin_.push_back(static_cast<int32_t>(edges_.size()));
  }
}

Span<const LaneGraph::Edge> LaneGraph::edges_of(int32_t lane) const {
  const std::size_t begin = at(edge_begin_[at(lane)]), end = at(edge_begin_[at(lane) + 1]);
  return {edges_.data() + begin, end - begin};
}

void LaneGraph::check(LanePosition position) const {
  PICTURA_CHECK(position.lane >= 0 && position.lane < num_lanes(), "lane graph: expected a lane in [0, {}), got {}",
                num_lanes(), position.lane);
  PICTURA_CHECK(position.s_m >= 0 && position.s_m <= length_m_[at(position.lane)],
                "lane graph: expected a place in [0, {}] m on lane {}, got {}", length_m_[at(position.lane)],
                position.lane, position.s_m);
}

double LaneGraph::distance_to_end_m(int32_t node, double begin_fraction) const {
  return (node < num_lanes() ? 1 : 1 - begin_fraction) * length_m_[at(lane_of(node))];
}

// Uses Dijkstra's algorithm (A note on two problems in connexion with graphs, 1959).
LaneGraph::Search LaneGraph::search(LanePosition from) const {
  check(from);
  Search result;
  result.begin_fraction = double{from.s_m} / length_m_[at(from.lane)];
  result.cost_m.assign(2 * length_m_.size(), kInfinite);
  result.previous.assign(2 * length_m_.size(), -1);
  result.is_lane_change.assign(2 * length_m_.size(), 0);
  using Entry = std::pair<double, int32_t>;  // cost and node
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto relax = [&](int32_t node, double cost_m, int32_t previous, bool is_lane_change) {
    if (cost_m >= result.cost_m[at(node)]) return;
    result.cost_m[at(node)] = cost_m;
    result.previous[at(node)] = previous;
    result.is_lane_change[at(node)] = is_lane_change;
    open.emplace(cost_m, node);
  };
  relax(from.s_m > 0 ? num_lanes() + from.lane : from.lane, 0, -1, false);
  while (!open.empty()) {
    const auto [cost_m, node] = open.top();
    open.pop();
    if (cost_m > result.cost_m[at(node)]) continue;
    const int32_t offset = node < num_lanes() ? 0 : num_lanes();
    for (const Edge& edge : edges_of(lane_of(node))) {
      if (edge.is_change) {
        relax(offset + edge.lane, cost_m + lane_change_cost_m_, node, true);
      } else {
        relax(edge.lane, cost_m + distance_to_end_m(node, result.begin_fraction), node, false);
      }
    }
  }
  return result;
}

std::optional<LaneRoute> LaneGraph::route(LanePosition from, LanePosition to) const {
  check(to);
  const Search result = search(from);
  // A route reaches the goal either from a position beside the start position, by lane changes only, or through the
  // start of the goal's lane.
  int32_t node = to.lane;
  double last_m = to.s_m;
  const int32_t start_node = num_lanes() + to.lane;
  const double ahead_m = to.s_m - result.begin_fraction * length_m_[at(to.lane)];
  if (ahead_m >= -kSamePosition_m && result.cost_m[at(start_node)] + ahead_m < result.cost_m[at(node)] + last_m) {
    node = start_node;
    last_m = std::max(ahead_m, 0.0);
  }
  if (result.cost_m[at(node)] == kInfinite) return std::nullopt;
  LaneRoute route;
  route.cost_m = result.cost_m[at(node)] + last_m;
  route.length_m = last_m;
  for (; node >= 0; node = result.previous[at(node)]) {
    route.lanes.push_back(lane_of(node));
    if (result.is_lane_change[at(node)]) {
      ++route.lane_changes;
    } else if (result.previous[at(node)] >= 0) {
      route.length_m += distance_to_end_m(result.previous[at(node)], result.begin_fraction);
    }
  }
  std::reverse(route.lanes.begin(), route.lanes.end());
  return route;
}

std::vector<double> LaneGraph::distances_from(LanePosition from) const {
  std::vector<double> distances = search(from).cost_m;
  distances.resize(length_m_.size());
  return distances;
}

std::vector<bool> LaneGraph::reachable_from(int32_t lane) const {
  std::vector<bool> reachable;
  for (const double distance_m : distances_from({lane, 0})) reachable.push_back(distance_m < kInfinite);
  return reachable;
}

LaneComponents LaneGraph::components() const {
  constexpr int32_t kUnvisited = -1;
  LaneComponents result;
  result.of_lane.assign(length_m_.size(), kUnvisited);
  std::vector<int32_t> order(length_m_.size(), kUnvisited);  // [lanes] visiting order
  std::vector<int32_t> lowest(length_m_.size());  // [lanes] lowest known order of a lane in the same component
  std::vector<int32_t> unassigned;
  struct Visit {
    int32_t lane;
    std::size_t next_edge;
  };
  std::vector<Visit> path;  // an explicit stack, because recursion along many lanes could overflow the call stack
  int32_t num_visited = 0;
  const auto enter = [&](int32_t lane) {
    order[at(lane)] = lowest[at(lane)] = num_visited++;
    unassigned.push_back(lane);
    path.push_back({lane, 0});
  };
  for (int32_t root = 0; root < num_lanes(); ++root) {
    if (order[at(root)] != kUnvisited) continue;
    enter(root);
    while (!path.empty()) {
      const int32_t lane = path.back().lane;
      if (path.back().next_edge < edges_of(lane).size()) {
        const int32_t next = edges_of(lane)[path.back().next_edge++].lane;
        if (order[at(next)] == kUnvisited) {
          enter(next);
        } else if (result.of_lane[at(next)] == kUnvisited) {
          lowest[at(lane)] = std::min(lowest[at(lane)], order[at(next)]);
        }
        continue;
      }
      path.pop_back();
      if (!path.empty()) {
        int32_t& lowest_before = lowest[at(path.back().lane)];
        lowest_before = std::min(lowest_before, lowest[at(lane)]);
      }
      if (lowest[at(lane)] != order[at(lane)]) continue;
      // The lane is the root of its component. The component consists of all lanes that were visited since the root and
      // have no component yet.
      int32_t member = kUnvisited;
      do {
        member = unassigned.back();
        unassigned.pop_back();
        result.of_lane[at(member)] = result.count;
      } while (member != lane);
      ++result.count;
    }
  }
  return result;
}

}  // namespace pictura
