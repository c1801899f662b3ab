// Limits of the dynamics and sizes of each class (docs/explanation/simulator.md). Limits of vehicles are those of the
// reference implementation of the paper's dynamics; others are this project's choice.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/math.h"
#include "pictura/common/portable/hd.h"

namespace pictura {

struct ClassLimits {
  float min_speed_mps, max_speed_mps;
  float min_accel_mps2, max_accel_mps2;  // longitudinal; Conditioning::acceleration multiplies the maximum
  float max_lat_accel_mps2;
  float max_steer_rad, max_steer_rate_radps;
  float min_length_m, max_length_m, min_width_m, max_width_m, height_m;
};

PICTURA_HD constexpr ClassLimits class_limits(AgentClass agent_class) {
  switch (agent_class) {
    case AgentClass::cyclist: return {-1.0f, 8.0f, -4.0f, 1.5f, 3.0f, 0.7f, 1.2f, 1.6f, 1.9f, 0.5f, 0.7f, 1.7f};
    case AgentClass::pedestrian: return {-1.0f, 2.5f, -4.0f, 2.0f, 2.0f, 1.0f, 4.0f, 0.4f, 0.6f, 0.4f, 0.7f, 1.7f};
    default: return {-2.0f, 20.0f, -5.0f, 2.5f, 4.0f, 0.55f, 0.6f, 3.5f, 5.5f, 1.6f, 2.2f, 1.5f};
  }
}

/// Maximum speed of any class. Recorded traffic may exceed kMaxSpeed_mps and kMaxBoxRadius_m, so rules use
/// MapView::max_speed_mps and MapView::max_box_radius_m.
constexpr float kMaxSpeed_mps = 20.0f;
/// Maximum half-diagonal of any class.
constexpr float kMaxBoxRadius_m = 3.2f;
/// Contact with barriers is tested only at the end of a step, so steps must be short.
constexpr float kMaxStep_s = 0.1f;

PICTURA_HD constexpr bool keeps_bounds(const ClassLimits& limits) {
  return square(limits.max_length_m) + square(limits.max_width_m) <= square(2.0f * kMaxBoxRadius_m) &&
         limits.max_speed_mps <= kMaxSpeed_mps && -limits.min_speed_mps <= kMaxSpeed_mps &&
         limits.max_speed_mps * kMaxStep_s <= limits.min_length_m;
}
static_assert(keeps_bounds(class_limits(AgentClass::vehicle)) && keeps_bounds(class_limits(AgentClass::cyclist)) &&
              keeps_bounds(class_limits(AgentClass::pedestrian)));

constexpr float kWheelbasePerLength = 0.6f;

/// Distance from the reference point forward to the box's centre. The reference point of vehicles and cyclists is the
/// rear axle, half a wheelbase behind the centre.
PICTURA_HD constexpr float reference_to_center(AgentClass agent_class, float length_m) {
  return agent_class == AgentClass::pedestrian ? 0.0f : 0.5f * kWheelbasePerLength * length_m;
}
/// Distance from the reference point forward to the front bumper.
PICTURA_HD constexpr float reference_to_bumper(AgentClass agent_class, float length_m) {
  return reference_to_center(agent_class, length_m) + 0.5f * length_m;
}

}  // namespace pictura
