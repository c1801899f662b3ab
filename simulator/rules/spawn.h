// The start of an episode: what an agent is, how it is conditioned, where it stands, and where it goes first.
#pragma once

#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/goal.h"
#include "pictura/simulator/rules/world_view.h"

namespace pictura {

constexpr int kSpawnTries = 32;
constexpr float kSpawnClearance_m = 0.5f;  // between a new box and every other
constexpr float kPedestrianGoalRadius_m = 0.5f;

/// Draws one coefficient: U(low, high), or a mixture of U(low, 1) and U(1, high) with equal chance. Equal bounds fix
/// it.
PICTURA_HD inline float draw_conditioning(const ConditioningRange& range, RandomStream* random_inout) {
  const float u = random_inout->uniform();
  if (!range.mixture || range.low == range.high) return range.low + (range.high - range.low) * u;
  return u < 0.5f ? range.low + (1.0f - range.low) * (2.0f * u) : 1.0f + (range.high - 1.0f) * (2.0f * u - 1.0f);
}

PICTURA_HD inline RandomStream agent_stream(const WorldView& world, int agent, uint32_t step, Purpose purpose) {
  return {world.seed, world.global_world, static_cast<uint32_t>(agent), world.episode, step, purpose};
}

/// Clears the agent's fields and draws its class, size and conditioning. It is absent until place_agent finds room.
PICTURA_HD inline void draw_agent(const WorldView& world, int agent) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  reset_fields(agents, slot);
  RandomStream class_random = agent_stream(world, agent, 0, Purpose::agent_class);
  const float u = class_random.uniform();
  const AgentClass agent_class = u < world.options.pedestrian_fraction ? AgentClass::pedestrian
                                 : u < world.options.pedestrian_fraction + world.options.cyclist_fraction
                                     ? AgentClass::cyclist
                                     : AgentClass::vehicle;
  const ClassLimits limits = class_limits(agent_class);
  RandomStream size_random = agent_stream(world, agent, 0, Purpose::agent_size);
  agents.agent_class[slot] = static_cast<uint8_t>(agent_class);
  agents.length_m[slot] = size_random.uniform(limits.min_length_m, limits.max_length_m);
  agents.width_m[slot] = size_random.uniform(limits.min_width_m, limits.max_width_m);
  agents.height_m[slot] = limits.height_m;

  RandomStream conditioning_random = agent_stream(world, agent, 0, Purpose::conditioning);
  float* conditioning = agents.conditioning + slot * kNumConditioning;
  for (int i = 0; i < kNumConditioning; ++i) {
    conditioning[i] = draw_conditioning(world.options.conditioning[i], &conditioning_random);
  }
  if (agent_class != AgentClass::pedestrian) return;
  // Paper: for pedestrians only the goal and collision terms are active, and the goal radius is capped.
  for (int i = static_cast<int>(Conditioning::off_road); i < kNumRewardConditioning; ++i) conditioning[i] = 0.0f;
  float& goal_radius_m = conditioning[static_cast<int>(Conditioning::delta_goal_m)];
  goal_radius_m = min_of(goal_radius_m, kPedestrianGoalRadius_m);
}

/// Draws a new goal chain that starts where the last one ended.
PICTURA_HD inline void draw_goal_chain(const WorldView& world, int agent) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  RandomStream random = agent_stream(world, agent, static_cast<uint32_t>(agents.goal_chains[slot]), Purpose::goals);
  RoutePoint at{agents.goal_lane[slot], agents.goal_lane_s_m[slot]};
  for (int i = 0; i < kNumWaypoints; ++i) {
    at = next_waypoint(world.map, at, &random);
    const LanePose pose = pose_on_lane(world.map, at.lane, at.s_m);
    agents.waypoint_x_m[slot * kNumWaypoints + i] = pose.position_m.x;
    agents.waypoint_y_m[slot * kNumWaypoints + i] = pose.position_m.y;
    agents.waypoint_z_m[slot * kNumWaypoints + i] = pose.position_m.z;
  }
  agents.next_waypoint[slot] = 0;
  agents.goal_lane[slot] = at.lane;
  agents.goal_lane_s_m[slot] = at.s_m;
  ++agents.goal_chains[slot];
}

/// A place uniform over the length of all spawnable lanes.
PICTURA_HD inline RoutePoint draw_spawn_point(const MapView& map, RandomStream* random_inout) {
  const size_t count = map.spawn_lanes.size();
  const float at_m = random_inout->uniform(0.0f, map.spawn_end_m[count - 1]);
  size_t low = 0, high = count - 1;
  while (low < high) {
    const size_t middle = (low + high) / 2;
    if (map.spawn_end_m[middle] > at_m) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  const float begin_m = low == 0 ? 0.0f : map.spawn_end_m[low - 1];
  return {map.spawn_lanes[low], at_m - begin_m};
}

/// Whether a box keeps kSpawnClearance_m from the boxes [begin, end).
PICTURA_HD inline bool is_clear(const WorldView& world, const AgentBox& box, int begin, int end) {
  AgentBox inflated = box;
  inflated.length_m += 2.0f * kSpawnClearance_m;
  inflated.width_m += 2.0f * kSpawnClearance_m;
  for (int i = begin; i < end; ++i) {
    const AgentBox& other = world.boxes[i];
    const Vec2 apart = (other.center_m - box.center_m).xy();
    if (!other.drawn || dot(apart, apart) > square(radius(inflated) + kMaxBoxRadius_m)) continue;
    if (same_level(inflated, other) && overlap(footprint(inflated), footprint(other))) return false;
  }
  return true;
}

PICTURA_HD inline bool touches_barrier(const MapView& map, const AgentBox& box) {
  return touches_any(footprint(box), box.center_m.z, map.edges, map.edge_cells) ||
         touches_any(footprint(box), box.center_m.z, map.walls, map.wall_cells);
}

/// Parks car `car` of the world, clear of the parked ones before it: on a parking lane or space, or outside a kerb and
/// off the road. It is not drawn, and nobody meets it, when kSpawnTries places were taken.
PICTURA_HD inline bool place_parked_car(const WorldView& world, int car) {
  constexpr float kKerbGap_m = 0.2f;
  const MapView& map = world.map;
  const int index = world.num_agents + car;
  const ClassLimits limits = class_limits(AgentClass::vehicle);
  RandomStream random = agent_stream(world, car, 0, Purpose::parked_cars);
  AgentBox box;
  box.length_m = random.uniform(limits.min_length_m, limits.max_length_m);
  box.width_m = random.uniform(limits.min_width_m, limits.max_width_m);
  box.height_m = limits.height_m;
  box.palette = 2;
  for (int i = 0; i < kSpawnTries && !map.parking_spots.empty(); ++i) {
    const ParkingSpot& spot =
        map.parking_spots[static_cast<size_t>(random.below(static_cast<int>(map.parking_spots.size())))];
    const Vec2 center = spot.position_m.xy() + spot.outward * (kKerbGap_m + 0.5f * box.width_m);
    const SinCos heading = sincos_of(spot.heading_rad);
    box.center_m = {center.x, center.y, spot.position_m.z};
    box.cos_heading = heading.cos;
    box.sin_heading = heading.sin;
    const bool is_at_kerb = dot(spot.outward, spot.outward) > 0.0f;
    if (touches_barrier(map, box) || (is_at_kerb && is_on_road(map, center, box.center_m.z)) ||
        !is_clear(world, box, world.num_agents, index)) {
      continue;
    }
    world.boxes[index] = world.boxes_before[index] = box;
    return true;
  }
  box.center_m = {};
  box.drawn = 0;
  world.boxes[index] = world.boxes_before[index] = box;
  return false;
}

/// Puts the agent on a lane, standing still along it, clear of parked cars and of the agents before it; it stays absent
/// when kSpawnTries places were taken. Returns whether it was placed.
PICTURA_HD inline bool place_agent(const WorldView& world, int agent) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  if (world.map.spawn_lanes.empty()) return false;
  RandomStream random = agent_stream(world, agent, 0, Purpose::spawn);
  for (int i = 0; i < kSpawnTries; ++i) {
    const RoutePoint at = draw_spawn_point(world.map, &random);
    const LanePose pose = pose_on_lane(world.map, at.lane, at.s_m);
    Motion motion;
    motion.x_m = pose.position_m.x;
    motion.y_m = pose.position_m.y;
    motion.heading_rad = pose.heading_rad;
    store_motion(agents, slot, motion);
    agents.z_m[slot] = pose.position_m.z;
    agents.status[slot] = static_cast<uint8_t>(AgentStatus::active);
    world.boxes[agent] = box_of(agents, slot);
    const AgentBox& box = world.boxes[agent];
    if (touches_barrier(world.map, box) || !is_on_road(world.map, box.center_m.xy(), box.center_m.z) ||
        !is_clear(world, box, 0, agent) || !is_clear(world, box, world.num_agents, world.num_boxes)) {
      continue;
    }
    world.boxes_before[agent] = world.boxes[agent];
    store_fit(agents, slot, fit_lane(world.map, pose.position_m.xy(), pose.position_m.z, pose.heading_rad, at.lane));
    agents.goal_lane[slot] = at.lane;
    agents.goal_lane_s_m[slot] = at.s_m;
    draw_goal_chain(world, agent);
    return true;
  }
  store_motion(agents, slot, Motion{});
  agents.z_m[slot] = 0.0f;
  agents.status[slot] = static_cast<uint8_t>(AgentStatus::absent);
  world.boxes[agent] = world.boxes_before[agent] = box_of(agents, slot);
  return false;
}

}  // namespace pictura
