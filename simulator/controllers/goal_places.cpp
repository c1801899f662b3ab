#include "pictura/simulator/controllers/goal_places.h"

#include <vector>

#include "pictura/common/error.h"
#include "pictura/simulator/rules/enter.h"

namespace pictura {

namespace {

/// Whether a pedestrian of maximum size touches no wall on the whole piece.
bool is_passable(const MapView& map, const WalkPiece& piece) {
  constexpr float kStep_m = 0.25f;
  const ClassLimits limits = class_limits(AgentClass::pedestrian);
  const int steps = static_cast<int>(piece.length_m / kStep_m) + 1;
  for (int i = 0; i <= steps; ++i) {
    const float along_m = piece.length_m * static_cast<float>(i) / static_cast<float>(steps);
    AgentBox box;
    const Vec2 at = piece.a_m.xy() + piece.direction * along_m;
    box.center_m = {at.x, at.y, height_on(piece, along_m)};
    box.cos_heading = piece.direction.x;
    box.sin_heading = piece.direction.y;
    box.length_m = limits.max_length_m;
    box.width_m = limits.max_width_m;
    if (touches_wall(map, box)) return false;
  }
  return true;
}

/// Reachability between points of walkways along passable pieces.
class WalkGraph {
 public:
  explicit WalkGraph(const MapView& map) : map_(map), network_(map.walk_leave_begin.size(), -1) {
    for (const WalkPiece& piece : map.walk_pieces) passable_.push_back(is_passable(map, piece));
    // Every piece has an opposite piece, so the graph is undirected, and a flood fill from node to node finds connected
    // networks.
    for (size_t node = 0; node + 1 < map.walk_leave_begin.size(); ++node) {
      if (network_[node] < 0) spread(static_cast<int32_t>(node));
    }
  }

  bool leads(RoutePoint from, RoutePoint to) const {
    const auto a = static_cast<size_t>(from.lane), b = static_cast<size_t>(to.lane);
    return passable_[a] && passable_[b] &&
           network_[map_.walk_pieces[a].to_node] == network_[map_.walk_pieces[b].to_node];
  }

 private:
  void spread(int32_t first) {
    std::vector<int32_t> open{first};
    network_[first] = first;
    while (!open.empty()) {
      const auto node = static_cast<size_t>(open.back());
      open.pop_back();
      for (int32_t i = map_.walk_leave_begin[node]; i < map_.walk_leave_begin[node + 1]; ++i) {
        const auto piece = static_cast<size_t>(map_.walk_leaving[i]);
        const int32_t next = map_.walk_pieces[piece].to_node;
        if (!passable_[piece] || network_[next] >= 0) continue;
        network_[next] = first;
        open.push_back(next);
      }
    }
  }

  const MapView map_;
  std::vector<bool> passable_;    // [walk_pieces]
  std::vector<int32_t> network_;  // [nodes] id of the node's network: one of its nodes
};

bool road_leads(const WorldView& world, const LaneGraph& graph, RoutePoint from, RoutePoint to) {
  const auto route = graph.route(lane_place(world.map, graph, from), lane_place(world.map, graph, to));
  // The route's length equals the gap, except for different lengths of neighbouring lanes.
  return route && route->length_m <= 2 * kMaxWaypointGap_m;
}

bool walk_leads(const WorldView& world, int agent, const WalkGraph& graph, RoutePoint from, RoutePoint to) {
  const LanePose pose = pose_of(world, agent, to);
  const AgentBox box = box_at(world.agents, world.first_slot + agent, pose.position_m, sincos_of(pose.heading_rad));
  return graph.leads(from, to) && is_clear(world, box, world.num_agents, world.num_boxes) &&
         !touches_wall(world.map, box);
}

}  // namespace

RoutePoint start_place(const WorldView& world, int agent) {
  const int slot = world.first_slot + agent;
  if (world.agents.life[slot] > 0) {
    return entry_place(world.map, drawn_entry(world, agent, world.agents.life_step[slot]),
                       world.agents.agent_class[slot], world.agents.length_m[slot]);
  }
  for (int i = 0; i < kSpawnTries; ++i) {
    const RoutePoint at = spawn_point(world, agent, i);
    const Vec3 place = pose_of(world, agent, at).position_m;
    if (place.x == world.agents.x_m[slot] && place.y == world.agents.y_m[slot]) return at;
  }
  fail("agent {}: expected it at one of its spawn points", agent);
}

std::array<RoutePoint, kNumWaypoints> goal_places(const WorldView& world, int agent, uint32_t chain, RoutePoint from) {
  RandomStream random = goal_stream(world, agent, static_cast<int32_t>(chain));
  std::array<RoutePoint, kNumWaypoints> places;
  for (RoutePoint& place : places) {
    from = place =
        walks(world, agent) ? next_walk_waypoint(world, agent, from, &random) : next_waypoint(world.map, from, &random);
  }
  return places;
}

LanePosition lane_place(const MapView& map, const LaneGraph& graph, RoutePoint at) {
  const float length_m = min_of(map.lanes[at.lane].length_m, graph.length_m(at.lane));
  return {at.lane, min_of(at.s_m, length_m)};
}

std::array<GoalReach, 2> follow_goals(const WorldView& world, const LaneGraph& graph, uint32_t chains) {
  const WalkGraph walkways(world.map);
  std::array<GoalReach, 2> reach;
  for (int agent = 0; agent < world.num_agents; ++agent) {
    if (!is_active(world, agent)) continue;
    const bool on_foot = walks(world, agent);
    GoalReach& count = reach[on_foot];
    ++count.agents;
    RoutePoint at = start_place(world, agent);
    for (uint32_t chain = 0; chain < chains; ++chain) {
      for (const RoutePoint next : goal_places(world, agent, chain, at)) {
        ++count.waypoints;
        count.unreachable +=
            !(on_foot ? walk_leads(world, agent, walkways, at, next) : road_leads(world, graph, at, next));
        at = next;
      }
    }
  }
  return reach;
}

}  // namespace pictura
