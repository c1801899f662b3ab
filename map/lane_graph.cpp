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
// Places that are level with each other but for rounding are not behind one another.
constexpr double kLevel_m = 1e-3;

std::size_t at(int32_t index) { return static_cast<std::size_t>(index); }

}  // namespace

LaneGraph::LaneGraph(const RoadMap& map, double lane_change_cost_m) : lane_change_cost_m_(lane_change_cost_m) {
  PICTURA_CHECK(lane_change_cost_m >= 0 && std::isfinite(lane_change_cost_m),
                "lane graph: expected a lane-change cost of 0 m or more, got {}", lane_change_cost_m);
  edge_begin_.push_back(0);
  for (const Lane& lane : map.lanes) {
    length_m_.push_back(lane.length_m);
    for (const int32_t next : map.links(lane.successors)) edges_.push_back({next, false});
    for (const int32_t beside : {lane.left_neighbor, lane.right_neighbor}) {
      if (beside >= 0) edges_.push_back({beside, true});
    }
    edge_begin_.push_back(static_cast<int32_t>(edges_.size()));
  }
}

Span<const LaneGraph::Edge> LaneGraph::edges_of(int32_t lane) const {
  const std::size_t begin = at(edge_begin_[at(lane)]), end = at(edge_begin_[at(lane) + 1]);
  return {edges_.data() + begin, end - begin};
}

void LaneGraph::check(LanePlace place) const {
  PICTURA_CHECK(place.lane >= 0 && place.lane < num_lanes(), "lane graph: expected a lane in [0, {}), got {}",
                num_lanes(), place.lane);
  PICTURA_CHECK(place.s_m >= 0 && place.s_m <= length_m_[at(place.lane)],
                "lane graph: expected a place in [0, {}] m on lane {}, got {}", length_m_[at(place.lane)], place.lane,
                place.s_m);
}

double LaneGraph::to_end_m(int32_t node, double begin_share) const {
  return (node < num_lanes() ? 1 : 1 - begin_share) * length_m_[at(lane_of(node))];
}

// Dijkstra (A note on two problems in connexion with graphs, 1959).
LaneGraph::Search LaneGraph::search(LanePlace from) const {
  check(from);
  Search found;
  found.begin_share = double{from.s_m} / length_m_[at(from.lane)];
  found.cost_m.assign(2 * length_m_.size(), kInfinite);
  found.before.assign(2 * length_m_.size(), -1);
  found.is_lane_change.assign(2 * length_m_.size(), 0);
  using Entry = std::pair<double, int32_t>;  // cost and node
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto reach = [&](int32_t node, double cost_m, int32_t before, bool is_lane_change) {
    if (cost_m >= found.cost_m[at(node)]) return;
    found.cost_m[at(node)] = cost_m;
    found.before[at(node)] = before;
    found.is_lane_change[at(node)] = is_lane_change;
    open.emplace(cost_m, node);
  };
  reach(from.s_m > 0 ? num_lanes() + from.lane : from.lane, 0, -1, false);
  while (!open.empty()) {
    const auto [cost_m, node] = open.top();
    open.pop();
    if (cost_m > found.cost_m[at(node)]) continue;
    const int32_t beside = node < num_lanes() ? 0 : num_lanes();
    for (const Edge& edge : edges_of(lane_of(node))) {
      if (edge.is_change) {
        reach(beside + edge.lane, cost_m + lane_change_cost_m_, node, true);
      } else {
        reach(edge.lane, cost_m + to_end_m(node, found.begin_share), node, false);
      }
    }
  }
  return found;
}

std::optional<LaneRoute> LaneGraph::route(LanePlace from, LanePlace to) const {
  check(to);
  const Search found = search(from);
  // Either the goal lies ahead of where the search began, or the route comes to its lane's beginning.
  int32_t node = to.lane;
  double last_m = to.s_m;
  const int32_t beside = num_lanes() + to.lane;
  const double ahead_m = to.s_m - found.begin_share * length_m_[at(to.lane)];
  if (ahead_m >= -kLevel_m && found.cost_m[at(beside)] + ahead_m < found.cost_m[at(node)] + last_m) {
    node = beside;
    last_m = std::max(ahead_m, 0.0);
  }
  if (found.cost_m[at(node)] == kInfinite) return std::nullopt;
  LaneRoute route;
  route.cost_m = found.cost_m[at(node)] + last_m;
  route.length_m = last_m;
  for (; node >= 0; node = found.before[at(node)]) {
    route.lanes.push_back(lane_of(node));
    if (found.is_lane_change[at(node)]) {
      ++route.lane_changes;
    } else if (found.before[at(node)] >= 0) {
      route.length_m += to_end_m(found.before[at(node)], found.begin_share);
    }
  }
  std::reverse(route.lanes.begin(), route.lanes.end());
  return route;
}

std::vector<double> LaneGraph::distances_from(LanePlace from) const {
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
  constexpr int32_t kUnseen = -1;
  LaneComponents found;
  found.of_lane.assign(length_m_.size(), kUnseen);
  std::vector<int32_t> order(length_m_.size(), kUnseen);  // in which lanes were first seen
  std::vector<int32_t> lowest(length_m_.size());          // order of the first lane known to be in the same component
  std::vector<int32_t> unassigned;
  struct Visit {
    int32_t lane;
    std::size_t next_edge;
  };
  std::vector<Visit> path;  // an explicit stack: chains of lanes may be longer than the program's
  int32_t seen = 0;
  const auto enter = [&](int32_t lane) {
    order[at(lane)] = lowest[at(lane)] = seen++;
    unassigned.push_back(lane);
    path.push_back({lane, 0});
  };
  for (int32_t root = 0; root < num_lanes(); ++root) {
    if (order[at(root)] != kUnseen) continue;
    enter(root);
    while (!path.empty()) {
      const int32_t lane = path.back().lane;
      if (path.back().next_edge < edges_of(lane).size()) {
        const int32_t next = edges_of(lane)[path.back().next_edge++].lane;
        if (order[at(next)] == kUnseen) {
          enter(next);
        } else if (found.of_lane[at(next)] == kUnseen) {
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
      // The first lane of its component: all that were seen since, and are in none, are the rest of it.
      int32_t member = kUnseen;
      do {
        member = unassigned.back();
        unassigned.pop_back();
        found.of_lane[at(member)] = found.count;
      } while (member != lane);
      ++found.count;
    }
  }
  return found;
}

}  // namespace pictura
