// Start of an episode or a life.
#pragma once

#include "pictura/simulator/rules/box_chains.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/goal.h"
#include "pictura/simulator/rules/record.h"
#include "pictura/simulator/rules/world_view.h"

namespace pictura {

constexpr int kSpawnTries = 32;
constexpr float kSpawnClearance_m = 0.5f;  // minimum gap to other boxes
constexpr float kPedestrianGoalRadius_m = 0.5f;

PICTURA_HD inline float draw_conditioning(const ConditioningRange& range, RandomStream* random_inout) {
  const float u = random_inout->uniform();
  if (!range.mixture || range.low == range.high) return range.low + (range.high - range.low) * u;
  return u < 0.5f ? range.low + (1.0f - range.low) * (2.0f * u) : 1.0f + (range.high - 1.0f) * (2.0f * u - 1.0f);
}

PICTURA_HD inline RandomStream agent_stream(const WorldView& world, int agent, uint32_t step, Purpose purpose) {
  return RandomStream({.seed = world.seed,
                       .world = world.global_world,
                       .agent = static_cast<uint32_t>(agent),
                       .episode = world.episode,
                       .step = step,
                       .purpose = purpose});
}

/// Random stream of a goal chain. The key is the life's first step plus the chain's index; keys of different lives
/// differ, because a life of n steps draws at most n chains.
PICTURA_HD inline RandomStream goal_stream(const WorldView& world, int agent, int32_t chain) {
  const int32_t life_step = world.agents.life_step[world.first_slot + agent];
  return agent_stream(world, agent, static_cast<uint32_t>(life_step) + static_cast<uint32_t>(chain), Purpose::goals);
}

/// Draws the size for the life that begins after `step` steps of the episode.
PICTURA_HD inline BodySize draw_size(const WorldView& world, int agent, AgentClass agent_class, int step) {
  const ClassLimits limits = class_limits(agent_class);
  RandomStream random = agent_stream(world, agent, static_cast<uint32_t>(step), Purpose::agent_size);
  BodySize size;
  size.length_m = random.uniform(limits.min_length_m, limits.max_length_m);
  size.width_m = random.uniform(limits.min_width_m, limits.max_width_m);
  size.height_m = limits.height_m;
  return size;
}

/// The class and life_step of the agent must be set. Recorded agents get their recorded size.
PICTURA_HD inline void draw_body(const WorldView& world, int agent) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const AgentClass agent_class = agents.agent_class[slot];
  const int step = agents.life_step[slot];
  const BodySize size = draw_size(world, agent, agent_class, step);
  agents.length_m[slot] = size.length_m;
  agents.width_m[slot] = size.width_m;
  agents.height_m[slot] = size.height_m;
  if (has_record(world.map)) store_recorded_size(world, agent);

  RandomStream conditioning_random = agent_stream(world, agent, static_cast<uint32_t>(step), Purpose::conditioning);
  float* conditioning = agents.conditioning + slot * kNumConditioning;
  for (int i = 0; i < kNumConditioning; ++i) {
    conditioning[i] = draw_conditioning(world.options.conditioning[i], &conditioning_random);
  }
  if (agent_class != AgentClass::pedestrian) return;
  // Paper: pedestrians get only the goal and collision rewards, and a limited goal radius.
  for (int i = static_cast<int>(Conditioning::off_road); i < kNumRewardConditioning; ++i) conditioning[i] = 0.0f;
  float& goal_radius_m = conditioning[static_cast<int>(Conditioning::delta_goal_m)];
  goal_radius_m = min_of(goal_radius_m, kPedestrianGoalRadius_m);
}

/// Resets the fields, then sets class, size and conditioning. Class and size are drawn or, on maps with a record,
/// recorded. The agent is absent until place_agent().
PICTURA_HD inline void draw_agent(const WorldView& world, int agent) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  reset_fields(agents, slot);
  RandomStream class_random = agent_stream(world, agent, 0, Purpose::agent_class);
  const float u = class_random.uniform();
  AgentClass agent_class = u < world.options.pedestrian_fraction ? AgentClass::pedestrian
                           : u < world.options.pedestrian_fraction + world.options.cyclist_fraction
                               ? AgentClass::cyclist
                               : AgentClass::vehicle;
  if (has_record(world.map)) {
    agent_class = static_cast<AgentClass>(world.map.recorded_agents[agent].agent_class);
  }
  agents.agent_class[slot] = agent_class;
  draw_body(world, agent);
}

PICTURA_HD inline AgentBox with_clearance(AgentBox box) {
  box.length_m += 2.0f * kSpawnClearance_m;
  box.width_m += 2.0f * kSpawnClearance_m;
  return box;
}

/// Maximum distance at which another box's centre can be if the box overlaps `inflated` (from with_clearance()).
PICTURA_HD inline float clearance_reach_m(const MapView& map, const AgentBox& inflated) {
  return radius(inflated) + map.max_box_radius_m;
}

/// `inflated` is a result of with_clearance().
PICTURA_HD inline bool blocks(const AgentBox& other, const MapView& map, const AgentBox& inflated) {
  const Vec2 apart = (other.center_m - inflated.center_m).xy();
  if (!other.drawn || dot(apart, apart) > square(clearance_reach_m(map, inflated))) return false;
  return same_level(inflated, other) && overlap(footprint(inflated), footprint(other));
}

/// Whether a box keeps kSpawnClearance_m from the boxes [begin, end).
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool is_clear(const WorldView& world, const AgentBox& box, int begin, int end,
                         const ThreadGroup& group = {}) {
  const AgentBox inflated = with_clearance(box);
  bool is_taken = false;
  for (int i = begin + group.rank(); i < end && !is_taken; i += group.size()) {
    is_taken = blocks(world.boxes[i], world.map, inflated);
  }
  return !group.any(is_taken);
}

/// Whether a box keeps kSpawnClearance_m from all boxes in the chains.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool is_clear(const WorldView& world, const AgentBox& box, const BoxChains& chains,
                         const ThreadGroup& group = {}) {
  const AgentBox inflated = with_clearance(box);
  return !any_box_near(chains, inflated.center_m.xy(), clearance_reach_m(world.map, inflated), group,
                       [&](int32_t other) { return blocks(world.boxes[other], world.map, inflated); });
}

template <typename ThreadGroup = SingleThread>
PICTURA_HD bool touches_wall(const MapView& map, const AgentBox& box, const ThreadGroup& group = {}) {
  return touches_any(footprint(box), box.center_m.z, map.walls, map.wall_cells, group);
}

template <typename ThreadGroup = SingleThread>
PICTURA_HD bool touches_barrier(const MapView& map, const AgentBox& box, const ThreadGroup& group = {}) {
  return touches_any(footprint(box), box.center_m.z, map.edges, map.edge_cells, group) || touches_wall(map, box, group);
}

PICTURA_HD inline LanePose pose_of(const WorldView& world, int agent, RoutePoint at) {
  return walks(world, agent) ? pose_on_walk(world.map, at.lane, at.s_m) : pose_on_lane(world.map, at.lane, at.s_m);
}

/// Returns a point a random distance ahead, or farther if a parked car occupies that point.
template <typename ThreadGroup = SingleThread>
PICTURA_HD RoutePoint next_walk_waypoint(const WorldView& world, int agent, RoutePoint at, RandomStream* random_inout,
                                         const ThreadGroup& group = {}) {
  constexpr float kStride_m = 1.0f;
  constexpr int kMaxStrides = 64;
  at = advance_along_walkway(world.map, at, random_inout->uniform(kMinWaypointGap_m, kMaxWaypointGap_m), random_inout);
  for (int i = 0; i < kMaxStrides; ++i) {
    const LanePose pose = pose_on_walk(world.map, at.lane, at.s_m);
    const AgentBox box = box_at(world.agents, world.first_slot + agent, pose.position_m, sincos_of(pose.heading_rad));
    if (is_clear(world, box, world.num_agents, world.num_boxes, group)) break;
    at = advance_along_walkway(world.map, at, kStride_m, random_inout);
  }
  return at;
}

/// Draws a goal chain from the end of the last one. On maps with a record, marks the only goal as reached.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void draw_goal_chain(const WorldView& world, int agent, const ThreadGroup& group = {}) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const int32_t chain = agents.goal_chains[slot];
  RandomStream random = goal_stream(world, agent, chain);
  RoutePoint at{agents.goal_lane[slot], agents.goal_lane_s_m[slot]};
  group.sync();
  if (has_record(world.map)) {
    if (group.rank() == 0) agents.goal_chains[slot] = kRecordedGoalReached;
    return;
  }
  for (int i = 0; i < kNumWaypoints; ++i) {
    at = walks(world, agent) ? next_walk_waypoint(world, agent, at, &random, group)
                             : next_waypoint(world.map, at, &random);
    const LanePose pose = pose_of(world, agent, at);
    if (group.rank() > 0) continue;
    agents.waypoint_x_m[slot * kNumWaypoints + i] = pose.position_m.x;
    agents.waypoint_y_m[slot * kNumWaypoints + i] = pose.position_m.y;
    agents.waypoint_z_m[slot * kNumWaypoints + i] = pose.position_m.z;
  }
  if (group.rank() > 0) return;
  agents.next_waypoint[slot] = 0;
  agents.goal_lane[slot] = at.lane;
  agents.goal_lane_s_m[slot] = at.s_m;
  agents.goal_chains[slot] = chain + 1;
}

/// Random spot of try `i`. The map must have parking spots.
PICTURA_HD inline const ParkingSpot& parking_spot(const WorldView& world, int car, int i) {
  constexpr int kDrawsBefore = 2;  // length and width
  RandomStream random = agent_stream(world, car, 0, Purpose::parked_cars);
  random.skip(kDrawsBefore + i);
  const Span<const ParkingSpot> spots = world.map.parking_spots;
  return spots[random.below(static_cast<int>(spots.size()))];
}

PICTURA_HD inline AgentBox parked_box(const WorldView& world, int car, const ParkingSpot& spot) {
  constexpr float kKerbGap_m = 0.2f;
  const ClassLimits limits = class_limits(AgentClass::vehicle);
  RandomStream random = agent_stream(world, car, 0, Purpose::parked_cars);
  AgentBox box;
  box.length_m = random.uniform(limits.min_length_m, limits.max_length_m);
  box.width_m = random.uniform(limits.min_width_m, limits.max_width_m);
  box.height_m = limits.height_m;
  box.palette = 2;
  const Vec2 center = spot.position_m.xy() + spot.outward * (kKerbGap_m + 0.5f * box.width_m);
  const SinCos heading = sincos_of(spot.heading_rad);
  box.center_m = {center.x, center.y, spot.position_m.z};
  box.cos_heading = heading.cos;
  box.sin_heading = heading.sin;
  return box;
}

/// Whether the box extends by more than kSeamTolerance_m into a driven lane.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool covers_driven_lane(const MapView& map, const AgentBox& box, const ThreadGroup& group = {}) {
  const OrientedBox print = footprint(box);
  const Span<const int32_t> items = items_at(map.segment_cells, print.center_m);
  bool covers = false;
  for (size_t i = static_cast<size_t>(group.rank()); i < items.size() && !covers;
       i += static_cast<size_t>(group.size())) {
    const LaneSegment& segment = map.segments[items[i]];
    const float half_m = 0.5f * segment.length_m;
    const OrientedBox surface{segment.a_m.xy() + segment.direction * half_m, segment.direction, half_m,
                              segment.half_width_m - kSeamTolerance_m};
    const float height = height_on(segment, half_m);
    covers = segment.is_driven && fabsf(height - box.center_m.z) < kLevel_m && overlap(print, surface);
  }
  return group.any(covers);
}

/// The box must touch no barrier and no driven lane. At a kerb, its centre must be off the road.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool may_park(const MapView& map, const AgentBox& box, const ParkingSpot& spot,
                         const ThreadGroup& group = {}) {
  const bool is_at_kerb = dot(spot.outward, spot.outward) > 0.0f;
  return !touches_barrier(map, box, group) && !covers_driven_lane(map, box, group) &&
         !(is_at_kerb && is_on_road(map, box.center_m.xy(), box.center_m.z, group));
}

/// Parks a car at the spot of try `i`. If i is -1, its box is not drawn and does not collide.
PICTURA_HD inline void put_parked_car(const WorldView& world, int car, int i) {
  AgentBox box = parked_box(world, car, i < 0 ? ParkingSpot{} : parking_spot(world, car, i));
  box.drawn = i >= 0;
  if (i < 0) box.center_m = {};
  world.boxes[world.num_agents + car] = world.boxes_before[world.num_agents + car] = box;
}

/// Draws a point uniformly on lanes or walkways. `end_m` is the running sum of their lengths. `lane` of the result is
/// an index into end_m.
PICTURA_HD inline RoutePoint draw_place(Span<const float> end_m, RandomStream* random_inout) {
  const float at_m = random_inout->uniform(0.0f, end_m[end_m.size() - 1]);
  size_t low = 0, high = end_m.size() - 1;
  while (low < high) {
    const size_t middle = (low + high) / 2;
    if (end_m[middle] > at_m) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return {static_cast<int32_t>(low), at_m - (low == 0 ? 0.0f : end_m[low - 1])};
}

/// Whether the agent could spawn on the map. Recorded agents need no places.
PICTURA_HD inline bool has_places(const WorldView& world, int agent) {
  if (has_record(world.map)) return false;
  return walks(world, agent) ? !world.map.walk_pieces.empty() : !world.map.spawn_lanes.empty();
}

/// Random point of try `i`, uniformly on the spawn lanes or, for pedestrians, on all walkways in both directions. The
/// map must have such lanes or walkways.
PICTURA_HD inline RoutePoint spawn_point(const WorldView& world, int agent, int i) {
  RandomStream random = agent_stream(world, agent, 0, Purpose::spawn);
  random.skip(i);
  if (walks(world, agent)) return draw_place(world.map.walk_end_m, &random);
  RoutePoint at = draw_place(world.map.spawn_end_m, &random);
  at.lane = world.map.spawn_lanes[at.lane];
  return at;
}

/// Box at the point of try `i`.
PICTURA_HD inline AgentBox spawn_box(const WorldView& world, int agent, int i) {
  const LanePose pose = pose_of(world, agent, spawn_point(world, agent, i));
  return box_at(world.agents, world.first_slot + agent, pose.position_m, sincos_of(pose.heading_rad));
}

/// A box must touch no barrier and have its centre on the road. A pedestrian's box need only be clear of walls.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool fits_map(const MapView& map, const AgentBox& box, const ThreadGroup& group = {}) {
  if (box.agent_class == AgentClass::pedestrian) return !touches_wall(map, box, group);
  return !touches_barrier(map, box, group) && is_on_road(map, box.center_m.xy(), box.center_m.z, group);
}

/// Whether a stop line for the box's direction is between its reference point and its front bumper.
PICTURA_HD inline bool straddles_stop_line(const MapView& map, const AgentBox& box) {
  const Vec2 forward{box.cos_heading, box.sin_heading};
  const Vec2 bumper = front_bumper(box);
  const Vec2 reference = box.center_m.xy() - forward * reference_to_center(box.agent_class, box.length_m);
  const Span<const int32_t> lights = items_at(map.stop_line_cells, bumper);
  for (size_t i = 0; i < lights.size(); ++i) {
    const StopLine& line = map.stop_lines[lights[i]];
    if (!holds(line, forward, box.center_m.z)) continue;
    const Vec2 past = bumper - line.middle_m.xy();
    const bool is_across =
        dot(past, line.direction) >= 0.0f && dot(reference - line.middle_m.xy(), line.direction) < 0.0f;
    if (is_across && is_within_ends(line, past)) return true;
  }
  return false;
}

/// Whether an agent may start with this box. Agents never start on a stop line, because driving on would not count as
/// crossing it.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool may_spawn(const MapView& map, const AgentBox& box, const ThreadGroup& group = {}) {
  return fits_map(map, box, group) && (box.agent_class == AgentClass::pedestrian || !straddles_stop_line(map, box));
}

/// `i` is the try at which the agent found a place, or -1. On maps with a record, all agents join; with replayed
/// tracks, only agents present at the start do.
PICTURA_HD inline bool joins_episode(const WorldView& world, int agent, int i) {
  if (has_replayed_tracks(world.map)) return has_body(world.agents.status[world.first_slot + agent]);
  return i >= 0 || has_record(world.map);
}

/// Places the agent with a speed along the route, and draws its first goal chain.
template <typename ThreadGroup>
PICTURA_HD void put_on_route(const WorldView& world, int agent, RoutePoint at, float speed_mps,
                             const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const LanePose pose = pose_of(world, agent, at);
  // A pedestrian has no lane yet.
  const int32_t own_lane = walks(world, agent) ? -1 : at.lane;
  const LaneFit fit =
      fit_agent(world, agent, pose.position_m.xy(), pose.position_m.z, pose.heading_rad, own_lane, group);
  if (group.rank() == 0) {
    Motion motion;
    motion.x_m = pose.position_m.x;
    motion.y_m = pose.position_m.y;
    motion.heading_rad = pose.heading_rad;
    motion.speed_mps = speed_mps;
    store_motion(agents, slot, motion);
    store_fit(agents, slot, fit);
    agents.status[slot] = AgentStatus::active;
    agents.goal_lane[slot] = at.lane;
    agents.goal_lane_s_m[slot] = at.s_m;
    world.boxes[agent] = world.boxes_before[agent] = box_of(agents, slot);
  }
  group.sync();
  draw_goal_chain(world, agent, group);
}

/// Places the agent at rest at the point of try `i`, or at the start of its record. If i is -1, an agent without a
/// record stays absent.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void place_agent(const WorldView& world, int agent, int i, const ThreadGroup& group = {}) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  if (has_record(world.map)) return begin_record(world, agent, group);
  if (i < 0) {
    if (group.rank() > 0) return;
    world.boxes[agent] = world.boxes_before[agent] = box_of(agents, slot);
    agents.refusal[slot] = has_places(world, agent) ? SpawnFailure::taken : SpawnFailure::no_place;
    return;
  }
  put_on_route(world, agent, spawn_point(world, agent, i), 0.0f, group);
}

}  // namespace pictura
