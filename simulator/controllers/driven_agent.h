// An agent that a controller drives, by its world's own rules: where its actions lead, and whether that leaves the
// road.
#pragma once

#include "pictura/simulator/rules/step.h"

namespace pictura {

/// A vehicle or cyclist.
class DrivenAgent {
 public:
  /// The view's arrays must outlive it, and the agent's body must stay as it is.
  DrivenAgent(const WorldView& world, int agent);

  Motion now() const { return motion_of(world_.agents, slot_); }
  /// A step later.
  Motion after(const Motion& from, int32_t action) const;
  /// The action without lateral jerk that brings it nearer to a speed; adding 0, 1 or 2 - kStraight steers.
  int32_t speed_action(const Motion& from, float wanted_mps) const;
  static constexpr int32_t kStraight = 1;

  /// Its box there, so much larger on every side.
  AgentBox box(Vec3 axle_m, float heading_rad, float margin_m) const;
  /// Whether its box, at that motion and height, and so much larger on every side, is not all on the road.
  bool leaves_road(const Motion& at, float z_m, float margin_m) const;
  /// Whether its front bumper crosses an exit in a step at that height: the agent is out then.
  bool crosses_exit(const Motion& before, const Motion& after, float z_m) const;
  /// From the rear axle to the front bumper.
  float to_bumper_m() const;
  float wheelbase_m() const { return parameters_.wheelbase_m; }
  float dt_s() const { return world_.options.dt_s; }

 private:
  static constexpr int kStepsToHalt = 3;
  struct Halt {
    int32_t action = 0;
    float cost = 0;
  };
  LongitudinalMotion along_after(LongitudinalMotion from, int32_t action) const;
  Halt halt(LongitudinalMotion from, int steps) const;

  WorldView world_;
  int slot_;
  DynamicsParameters parameters_;
  ClassLimits limits_;
};

}  // namespace pictura
