// Entry on open maps: agents that have left wait for room at the beginning of a lane.
#pragma once

#include "pictura/simulator/rules/spawn.h"

namespace pictura {

constexpr float kEntryInside_m = 0.1f;  // from the lane's start to the rear bumper
constexpr float kMaxEntry_mps = 8.0f;
constexpr float kEntryGap_m = 2.0f, kEntryHeadway_s = 2.0f;  // minimum gap: 2 m plus 2 s times the speed

/// An agent cannot enter in the step in which it leaves, because its box is still visible.
PICTURA_HD inline bool is_waiting_to_enter(const WorldView& world, int agent) {
  return world.agents.status[world.first_slot + agent] == AgentStatus::waiting && !world.boxes[agent].drawn;
}

/// Random entry for the end of step `step`. The map must have entries.
PICTURA_HD inline const Entry& drawn_entry(const WorldView& world, int agent, int step) {
  RandomStream random = agent_stream(world, agent, static_cast<uint32_t>(step), Purpose::entry);
  return world.map.entries[random.below(static_cast<int>(world.map.entries.size()))];
}

/// Returns the point distance_m ahead along first successors, or the route's end.
PICTURA_HD inline RoutePoint point_ahead(const MapView& map, RoutePoint at, float distance_m) {
  constexpr int kMaxLanesAhead = 64;  // a safety bound
  at.s_m += distance_m;
  for (int i = 0; i < kMaxLanesAhead; ++i) {
    const MapLane& lane = map.lanes[at.lane];
    if (at.s_m <= lane.length_m || lane.num_successors == 0) break;
    at = {map.successors[lane.first_successor], at.s_m - lane.length_m};
  }
  return {at.lane, min_of(at.s_m, map.lanes[at.lane].length_m)};
}

/// Reference point of an agent that enters.
PICTURA_HD inline RoutePoint entry_place(const MapView& map, const Entry& entry, AgentClass agent_class,
                                         float length_m) {
  const float to_rear_m = 0.5f * length_m - reference_to_center(agent_class, length_m);
  return point_ahead(map, {entry.lane, 0.0f}, kEntryInside_m + to_rear_m);
}

struct NextBox {
  float gap_m = 1e9f;   // from the front bumper, in multiples of 0.5 m
  float speed_mps = 0;  // along the route
};

/// Finds the next box on the route of an agent with box `own` and reference point `at`, up to the gap required at the
/// maximum entry speed.
template <typename ThreadGroup>
PICTURA_HD NextBox next_box(const WorldView& world, const AgentBox& own, RoutePoint at, const ThreadGroup& group) {
  constexpr float kStride_m = 0.5f;
  constexpr float kLookahead_m = kEntryGap_m + kEntryHeadway_s * kMaxEntry_mps;
  const float ahead_m = reference_to_center(own.agent_class, own.length_m);
  NextBox next;
  int next_index = world.num_boxes;
  for (int i = group.rank(); i < world.num_boxes; i += group.size()) {
    const AgentBox& other = world.boxes[i];
    const Vec2 apart = (other.center_m - own.center_m).xy();
    const float reach_m = kLookahead_m + radius(own) + world.map.max_box_radius_m;
    if (!other.drawn || dot(apart, apart) > square(reach_m)) continue;
    for (float way_m = kStride_m; way_m - kStride_m < min_of(next.gap_m, kLookahead_m); way_m += kStride_m) {
      const RoutePoint there = point_ahead(world.map, at, way_m);
      const LanePose pose = pose_on_lane(world.map, there.lane, there.s_m);
      const SinCos heading = sincos_of(pose.heading_rad);
      AgentBox box = own;
      box.center_m = pose.position_m + Vec3{ahead_m * heading.cos, ahead_m * heading.sin, 0.0f};
      box.cos_heading = heading.cos;
      box.sin_heading = heading.sin;
      if (!same_level(box, other) || !overlap(footprint(box), footprint(other))) continue;
      next.gap_m = way_m - kStride_m;
      const float speed_mps = i < world.num_agents ? world.agents.speed_mps[world.first_slot + i] : 0.0f;
      const float along = other.cos_heading * heading.cos + other.sin_heading * heading.sin;
      next.speed_mps = max_of(speed_mps * along, 0.0f);
      next_index = i;
      break;
    }
  }
  return group.of_lowest(next.gap_m, next_index, next);
}

/// Whether an agent with a lower index entered in this step through an entry whose Entry::turn is `turn`.
template <typename ThreadGroup>
PICTURA_HD bool is_turn_taken(const WorldView& world, int agent, int step, int32_t turn, const ThreadGroup& group) {
  bool is_taken = false;
  for (int other = group.rank(); other < agent && !is_taken; other += group.size()) {
    const bool entered = world.agents.life_step[world.first_slot + other] == step;
    is_taken = entered && drawn_entry(world, other, step).turn == turn;
  }
  return group.any(is_taken);
}

/// Begins the next life of an agent.
template <typename ThreadGroup>
PICTURA_HD void begin_life(const WorldView& world, int agent, int step, RoutePoint at, float speed_mps,
                           const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  if (group.rank() == 0) {
    const AgentClass agent_class = agents.agent_class[slot];
    const int32_t life = agents.life[slot] + 1;
    reset_fields(agents, slot);
    agents.agent_class[slot] = agent_class;
    agents.life[slot] = life;
    agents.life_step[slot] = step;
    draw_body(world, agent);
  }
  group.sync();
  put_on_route(world, agent, at, speed_mps, group);
}

/// Makes a waiting agent enter at the end of step `step` if its random entry has room.
template <typename ThreadGroup>
PICTURA_HD bool try_to_enter(const WorldView& world, int agent, int step, const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const Entry& entry = drawn_entry(world, agent, step);
  if (is_turn_taken(world, agent, step, entry.turn, group)) return false;
  const AgentClass agent_class = agents.agent_class[slot];
  const BodySize size = draw_size(world, agent, agent_class, step);
  const RoutePoint at = entry_place(world.map, entry, agent_class, size.length_m);
  const LanePose pose = pose_on_lane(world.map, at.lane, at.s_m);
  const AgentBox box = box_at(agent_class, size, pose.position_m, sincos_of(pose.heading_rad));
  if (!may_spawn(world.map, box, group) || !is_clear(world, box, 0, world.num_boxes, group)) return false;
  const NextBox next = next_box(world, box, at, group);
  float speed_mps = min_of(kMaxEntry_mps, world.map.lanes[at.lane].speed_limit_mps);
  speed_mps = min_of(speed_mps, class_limits(agent_class).max_speed_mps);
  if (next.gap_m < 1e9f) speed_mps = min_of(speed_mps, next.speed_mps);
  if (next.gap_m < kEntryGap_m + kEntryHeadway_s * speed_mps) return false;
  group.sync();
  begin_life(world, agent, step, at, speed_mps, group);
  return true;
}

/// Makes waiting agents enter at the end of step `step`, in the order of indices. Calls entered(agent) for each.
template <typename ThreadGroup, typename Entered>
PICTURA_HD void enter_waiting(const WorldView& world, int step, const ThreadGroup& group, const Entered& entered) {
  if (world.map.entries.empty()) return;
  for (int agent = 0; agent < world.num_agents; ++agent) {
    if (!is_waiting_to_enter(world, agent) || !try_to_enter(world, agent, step, group)) continue;
    group.sync();
    entered(agent);
  }
}

}  // namespace pictura
