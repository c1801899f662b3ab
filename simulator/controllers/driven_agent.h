// Prediction of an agent's motion.
#pragma once

#include "pictura/simulator/rules/step.h"

namespace pictura {

/// A vehicle or cyclist that a controller drives.
class DrivenAgent {
 public:
  /// The arrays of `world` must outlive this object. The agent's class and size must not change.
  DrivenAgent(const WorldView& world, int agent);

  Motion now() const { return motion_of(world_.agents, slot_); }
  Motion after(const Motion& from, int32_t action) const;
  /// Returns the best action without lateral jerk for reaching a speed. For the lateral jerk of index k (0 to 2,
  /// actions.h), add k - kStraight to the action.
  int32_t speed_action(const Motion& from, float wanted_mps) const;
  static constexpr int32_t kStraight = 1;

  /// Returns the box at a pose, enlarged by a margin on every side.
  AgentBox box(Vec3 axle_m, float heading_rad, float margin_m) const;
  /// Whether the enlarged box at this motion is partly off the road.
  bool leaves_road(const Motion& at, float z_m, float margin_m) const;
  /// Whether the front bumper crosses an exit of the map.
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
