// Gigaflow's dynamics: a jerk-controlled kinematic bicycle whose rear axle moves along a circular arc. The formulae
// follow the public reference implementation of the paper's simulator.
#pragma once

#include "pictura/common/math.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/rule_choices.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {

struct Motion {
  float x_m = 0, y_m = 0, heading_rad = 0;
  float speed_mps = 0;
  float accel_long_mps2 = 0, accel_lat_mps2 = 0;
  float steer_rad = 0;
  float jerk_long_mps3 = 0, jerk_lat_mps3 = 0;  // change of acceleration per second
};

struct Controls {
  float jerk_long_mps3 = 0, jerk_lat_mps3 = 0;  // lateral: positive to the left
};

/// Returns the jerks of an action (paper: 4 x 3 bins).
PICTURA_HD constexpr Controls controls_of_action(int action) {
  const float jerk_long[kNumLongActions] = {-15.0f, -4.0f, 0.0f, 4.0f};
  const float jerk_lat[kNumLatActions] = {-4.0f, 0.0f, 4.0f};
  return {jerk_long[action / kNumLatActions], jerk_lat[action % kNumLatActions]};
}

/// Multipliers (from the agent's conditioning), wheelbase and options.
struct DynamicsParameters {
  float throttle = 1, steer = 1, acceleration = 1;
  float wheelbase_m = 2.7f;
  DynamicsRules rules{};
};

/// speed_mps is the speed after the step.
PICTURA_HD inline float driven_m(float speed_mps, float dt_s) { return fabsf(speed_mps) * dt_s; }

/// Returns 0 if `value` and `before` have opposite signs, else `value` clamped to [low, high].
PICTURA_HD inline float stop_at_zero(float before, float value, float low, float high) {
  return before * value < 0.0f ? 0.0f : clamp(value, low, high);
}

struct LongitudinalMotion {
  float speed_mps = 0, accel_mps2 = 0;
};

/// Advances by one step within `limits`.
PICTURA_HD inline LongitudinalMotion move_along(LongitudinalMotion from, float jerk_mps3,
                                                const DynamicsParameters& parameters, const ClassLimits& limits,
                                                float dt_s) {
  LongitudinalMotion to;
  to.accel_mps2 = stop_at_zero(from.accel_mps2, from.accel_mps2 + parameters.throttle * jerk_mps3 * dt_s,
                               limits.min_accel_mps2, limits.max_accel_mps2 * parameters.acceleration);
  const float wanted_mps = from.speed_mps + 0.5f * (to.accel_mps2 + from.accel_mps2) * dt_s;
  to.speed_mps = stop_at_zero(from.speed_mps, wanted_mps, limits.min_speed_mps, limits.max_speed_mps);
  const bool changes_sign = from.speed_mps * wanted_mps < 0.0f;
  if (parameters.rules.reset_at_standstill && changes_sign) to.accel_mps2 = 0.0f;
  return to;
}

/// A recorded vehicle that is too long for its class gets the minimum turning radius of the longest allowed vehicle.
PICTURA_HD inline float max_steer_rad(float wheelbase_m, const ClassLimits& limits) {
  const float longest_m = kWheelbasePerLength * limits.max_length_m;
  if (wheelbase_m <= longest_m) return limits.max_steer_rad;
  return atan_of(tan_of(limits.max_steer_rad) * (wheelbase_m / longest_m));
}

/// Advances by one step within `limits`. The lateral acceleration follows from the steering angle, whose rate is
/// limited.
PICTURA_HD inline Motion move(const Motion& from, Controls controls, const DynamicsParameters& parameters,
                              const ClassLimits& limits, float dt_s) {
  constexpr float kMinTurningSpeed_mps = 1.0f;
  constexpr float kStraight = 1e-5f;
  Motion to = from;
  const LongitudinalMotion along =
      move_along({from.speed_mps, from.accel_long_mps2}, controls.jerk_long_mps3, parameters, limits, dt_s);
  to.speed_mps = along.speed_mps;
  to.accel_long_mps2 = along.accel_mps2;
  const float wanted_lat =
      stop_at_zero(from.accel_lat_mps2, from.accel_lat_mps2 + parameters.steer * controls.jerk_lat_mps3 * dt_s,
                   -limits.max_lat_accel_mps2, limits.max_lat_accel_mps2);

  const float turning_speed = max_of(fabsf(to.speed_mps), kMinTurningSpeed_mps);
  const float wanted_steer = atan_of(wanted_lat / square(turning_speed) * parameters.wheelbase_m);
  const float max_change = limits.max_steer_rate_radps * dt_s;
  const float max_steer = max_steer_rad(parameters.wheelbase_m, limits);
  to.steer_rad =
      clamp(from.steer_rad + clamp(wanted_steer - from.steer_rad, -max_change, max_change), -max_steer, max_steer);
  const float curvature = tan_of(to.steer_rad) / parameters.wheelbase_m;
  to.accel_lat_mps2 = square(to.speed_mps) * curvature;

  const float distance = 0.5f * (to.speed_mps + from.speed_mps) * dt_s;
  const float turn = distance * curvature;
  Vec2 local{distance, 0.0f};
  if (fabsf(curvature) >= kStraight && fabsf(turn) >= kStraight) {
    const SinCos arc = sincos_of(turn);
    local = {arc.sin / curvature, (1.0f - arc.cos) / curvature};
  }
  const SinCos heading = sincos_of(from.heading_rad);
  to.x_m = from.x_m + (local.x * heading.cos - local.y * heading.sin);
  to.y_m = from.y_m + (local.x * heading.sin + local.y * heading.cos);
  to.heading_rad = wrap_angle(from.heading_rad + turn);
  to.jerk_long_mps3 = (to.accel_long_mps2 - from.accel_long_mps2) / dt_s;
  to.jerk_lat_mps3 = (to.accel_lat_mps2 - from.accel_lat_mps2) / dt_s;
  return to;
}

}  // namespace pictura
