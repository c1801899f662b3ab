#include "pictura/simulator/controllers/driven_agent.h"

#include <algorithm>
#include <cmath>

namespace pictura {

DrivenAgent::DrivenAgent(const WorldView& world, int agent)
    : world_(world),
      slot_(world.first_slot + agent),
      parameters_(dynamics_of(world, slot_)),
      limits_(class_limits(world.agents.agent_class[slot_])) {}

Motion DrivenAgent::after(const Motion& from, int32_t action) const {
  return move(from, controls_of_action(action), parameters_, limits_, world_.options.dt_s);
}

LongitudinalMotion DrivenAgent::along_after(LongitudinalMotion from, int32_t action) const {
  return move_along(from, controls_of_action(action).jerk_long_mps3, parameters_, limits_, world_.options.dt_s);
}

int32_t DrivenAgent::speed_action(const Motion& from, float wanted_mps) const {
  constexpr float kSlow_mps = 0.5f, kReaction_s = 0.6f, kBraking_mps2 = 4, kAccelerating_mps2 = 1.5f;
  LongitudinalMotion along{from.speed_mps, from.accel_long_mps2};
  if (wanted_mps == 0 && std::fabs(from.speed_mps) < kSlow_mps) return halt(along, kStepsToHalt).action;
  const float wanted_mps2 = std::clamp((wanted_mps - from.speed_mps) / kReaction_s, -kBraking_mps2, kAccelerating_mps2);
  // An acceleration that is not 0 only by rounding would make all opposite jerks end at 0 (see stop_at_zero()), so it
  // is cleared.
  if (std::fabs(along.accel_mps2) < 1e-3f) along.accel_mps2 = 0;
  int32_t best = kStraight;
  float minimum = INFINITY;
  for (int32_t action = kStraight; action < kNumActions; action += kNumLatActions) {
    const float off = std::fabs(along_after(along, action).accel_mps2 - wanted_mps2);
    if (off >= minimum) continue;
    minimum = off;
    best = action;
  }
  return best;
}

/// Searches `steps` steps ahead for actions that bring the agent to rest. A rule without search does not suffice,
/// because the jerks of actions are too coarse.
DrivenAgent::Halt DrivenAgent::halt(LongitudinalMotion from, int steps) const {
  constexpr float kPerAcceleration_s = 0.3f;
  if (steps == 0) return {kStraight, kPerAcceleration_s * std::fabs(from.accel_mps2)};
  Halt best{kStraight, INFINITY};
  for (int32_t action = kStraight; action < kNumActions; action += kNumLatActions) {
    const LongitudinalMotion next = along_after(from, action);
    if (std::fabs(next.speed_mps) >= best.cost) continue;
    const float cost = std::fabs(next.speed_mps) + halt(next, steps - 1).cost;
    if (cost < best.cost) best = {action, cost};
  }
  return best;
}

AgentBox DrivenAgent::box(Vec3 axle_m, float heading_rad, float margin_m) const {
  AgentBox box = box_at(world_.agents, slot_, axle_m, sincos_of(heading_rad));
  box.length_m += 2 * margin_m;
  box.width_m += 2 * margin_m;
  return box;
}

bool DrivenAgent::leaves_road(const Motion& at, float z_m, float margin_m) const {
  return !fits_map(world_.map, box({at.x_m, at.y_m, z_m}, at.heading_rad, margin_m));
}

bool DrivenAgent::crosses_exit(const Motion& before, const Motion& after, float z_m) const {
  if (world_.map.exits.empty()) return false;
  const auto box_of = [&](const Motion& at) { return box({at.x_m, at.y_m, z_m}, at.heading_rad, 0); };
  return pictura::crosses_exit(world_.map, box_of(before), box_of(after));
}

float DrivenAgent::to_bumper_m() const {
  return reference_to_bumper(world_.agents.agent_class[slot_], world_.agents.length_m[slot_]);
}

}  // namespace pictura
