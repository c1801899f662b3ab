// An agent that a controller drives, by its world's own rules: the motions that result from actions, and whether they
// leave the road.
#pragma once

#include "pictura/simulator/rules/step.h"

namespace pictura {

/// A vehicle or cyclist.
class DrivenAgent {
 public:
  /// The view's arrays must outlive this object, and the agent's body must not change.
  DrivenAgent(const WorldView& world, int agent);

  Motion now() const { return motion_of(world_.agents, slot_); }
  /// Motion one step later.
  Motion after(const Motion& from, int32_t action) const;
  /// Returns the action without lateral jerk that brings the agent nearest to a speed. To steer, add k - kStraight,
  /// where k is 0, 1 or 2.
  int32_t speed_action(const Motion& from, float wanted_mps) const;
  static constexpr int32_t kStraight = 1;

  /// Box of the agent at a pose, enlarged by a margin on every side.
  AgentBox box(Vec3 axle_m, float heading_rad, float margin_m) const;
  /// Whether the agent's box at this motion and height, enlarged by a margin on every side, is partly off the road.
  bool leaves_road(const Motion& at, float z_m, float margin_m) const;
  /// Whether the front bumper crosses an exit in a step at this height, which means that the agent leaves the map.
  bool crosses_exit(const Motion& before, const Motion& after, float z_m) const;
  /// Distance from the rear axle to the front bumper.
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
