// One world as the rules see it, in host or device memory of the executor.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/rules/dynamics.h"
#include "pictura/simulator/rules/impairment.h"
#include "pictura/simulator/rules/road.h"
#include "pictura/simulator/rules/signal.h"

namespace pictura {

/// Part of SimulatorConfig that the rules read.
struct RuleOptions {
  float dt_s = 0.1f;
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;
  bool stagger_episodes = false;
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = false;
  float pedestrian_fraction = 0, cyclist_fraction = 0;
  bool fixed_lights = false;
  LightCycles light_cycles = LightCycles::phases;
  DynamicsRules dynamics{};
  OtherShares others{};
  bool auxiliary_observations = true;
  ConditioningRange conditioning[kNumConditioning] = {};        // ranges for draws
  ConditioningRange conditioning_scale[kNumConditioning] = {};  // ranges observed as [-1, 1]
};

struct WorldView {
  const MapView& map;
  const RuleOptions& options;
  int index = 0;  // among the simulator's worlds
  uint64_t seed = 0;
  uint32_t global_world = 0;
  uint32_t episode = 0;
  int step = 0;                    // steps taken in the episode
  bool has_other_drivers = false;  // whether options.others has a share above 0
  AgentStateView agents{};         // [slots of all worlds]
  int first_slot = 0;
  int num_agents = 0;  // controlled agents
  int first_box = 0;   // in the scene
  int num_boxes = 0;
  AgentBox* boxes = nullptr;         // [num_boxes] controlled agents, then parked cars
  AgentBox* boxes_before = nullptr;  // [num_boxes] before the step
  GridView box_cells;                // visible boxes by the cell of their centres
  Vec2* cell_centers = nullptr;      // [num_boxes] in the order of box_cells.items
  LightPlan* light_plans = nullptr;  // [stop lines]
  LightState* lights = nullptr;      // [stop lines] state during the step, which agents observed before it
};

PICTURA_HD inline Motion motion_of(const AgentStateView& agents, int slot) {
  return {.x_m = agents.x_m[slot],
          .y_m = agents.y_m[slot],
          .heading_rad = agents.heading_rad[slot],
          .speed_mps = agents.speed_mps[slot],
          .accel_long_mps2 = agents.accel_long_mps2[slot],
          .accel_lat_mps2 = agents.accel_lat_mps2[slot],
          .steer_rad = agents.steer_rad[slot],
          .jerk_long_mps3 = agents.jerk_long_mps3[slot],
          .jerk_lat_mps3 = agents.jerk_lat_mps3[slot]};
}

/// `heading` must be sincos_of(motion.heading_rad).
PICTURA_HD inline void store_motion(const AgentStateView& agents, int slot, const Motion& motion, SinCos heading) {
  agents.x_m[slot] = motion.x_m;
  agents.y_m[slot] = motion.y_m;
  agents.heading_rad[slot] = motion.heading_rad;
  agents.cos_heading[slot] = heading.cos;
  agents.sin_heading[slot] = heading.sin;
  agents.speed_mps[slot] = motion.speed_mps;
  agents.accel_long_mps2[slot] = motion.accel_long_mps2;
  agents.accel_lat_mps2[slot] = motion.accel_lat_mps2;
  agents.steer_rad[slot] = motion.steer_rad;
  agents.jerk_long_mps3[slot] = motion.jerk_long_mps3;
  agents.jerk_lat_mps3[slot] = motion.jerk_lat_mps3;
}

PICTURA_HD inline void store_motion(const AgentStateView& agents, int slot, const Motion& motion) {
  store_motion(agents, slot, motion, sincos_of(motion.heading_rad));
}

PICTURA_HD inline LaneFit fit_of(const AgentStateView& agents, int slot) {
  return {agents.lane[slot], agents.lane_offset_m[slot], agents.lane_angle_rad[slot], agents.z_m[slot],
          agents.speed_limit_mps[slot]};
}

PICTURA_HD inline void store_fit(const AgentStateView& agents, int slot, const LaneFit& fit) {
  agents.lane[slot] = fit.lane;
  agents.lane_offset_m[slot] = fit.offset_m;
  agents.lane_angle_rad[slot] = fit.angle_rad;
  agents.z_m[slot] = fit.z_m;
  agents.speed_limit_mps[slot] = fit.speed_limit_mps;
}

struct BodySize {
  float length_m = 0, width_m = 0, height_m = 0;
};

PICTURA_HD inline AgentBox box_at(AgentClass agent_class, const BodySize& size, Vec3 position_m, SinCos heading) {
  const float ahead = reference_to_center(agent_class, size.length_m);
  AgentBox box;
  box.center_m = {position_m.x + ahead * heading.cos, position_m.y + ahead * heading.sin, position_m.z};
  box.cos_heading = heading.cos;
  box.sin_heading = heading.sin;
  box.length_m = size.length_m;
  box.width_m = size.width_m;
  box.height_m = size.height_m;
  box.agent_class = agent_class;
  return box;
}

PICTURA_HD inline AgentBox box_at(const AgentStateView& agents, int slot, Vec3 position_m, SinCos heading) {
  const BodySize size{agents.length_m[slot], agents.width_m[slot], agents.height_m[slot]};
  return box_at(agents.agent_class[slot], size, position_m, heading);
}

constexpr uint8_t kHaltedPalette = 1;

/// The box of an agent without a body is neither drawn nor part of collisions.
PICTURA_HD inline AgentBox box_of(const AgentStateView& agents, int slot) {
  const AgentStatus status = agents.status[slot];
  AgentBox box = box_at(agents, slot, {agents.x_m[slot], agents.y_m[slot], agents.z_m[slot]},
                        {agents.sin_heading[slot], agents.cos_heading[slot]});
  box.palette = status == AgentStatus::halted ? kHaltedPalette : 0;
  box.drawn = has_body(status);
  return box;
}

/// See draw_driver_kind().
PICTURA_HD inline int driver_kind_of(const WorldView& world, int agent) {
  if (!world.has_other_drivers) return 0;
  return draw_driver_kind(world.options.others, world.seed, world.global_world, static_cast<uint32_t>(agent),
                          world.episode);
}

/// Returns `none` if the impairment is not active at this step.
PICTURA_HD inline Impairment active_impairment(const WorldView& world, int agent) {
  const Impairment impairment = impairment_of(driver_kind_of(world, agent));
  const bool shows = is_active_at(impairment, world.step, world.options.dt_s, world.seed, world.global_world,
                                  static_cast<uint32_t>(agent), world.episode);
  return shows ? impairment : Impairment::none;
}

PICTURA_HD inline Hides hidden_from(const WorldView& world, int agent) {
  return hidden_by(active_impairment(world, agent));
}

/// `hidden` must be the result of hidden_from(). For absent agents, see Simulator::views().
PICTURA_HD inline View view_of(const WorldView& world, int agent, Hides hidden) {
  View view;
  view.world = world.index;
  view.key = {world.global_world, static_cast<uint32_t>(agent), world.episode, static_cast<uint32_t>(world.step)};
  if (!world.boxes[agent].drawn) return view;
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  view.ego_agent = world.first_box + agent;
  view.origin_m = {agents.x_m[slot], agents.y_m[slot], agents.z_m[slot]};
  view.cos_heading = agents.cos_heading[slot];
  view.sin_heading = agents.sin_heading[slot];
  view.body_length_m = agents.length_m[slot];
  view.hides = hidden;
  return view;
}

}  // namespace pictura
