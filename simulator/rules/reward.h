// Reward terms (paper, appendix, equation of the reward terms).
#pragma once

#include "pictura/common/math.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/reward_terms.h"
#include "pictura/simulator/rules/dynamics.h"
#include "pictura/simulator/rules/road.h"

namespace pictura {

/// Events and state of a step for the reward.
struct StepFacts {
  Motion motion;  // before an infraction halts the agent
  LaneFit fit;
  bool passed_waypoint = false;  // an intermediate waypoint
  bool passed_last_waypoint = false;
  bool collision = false, off_road = false, red_light = false;  // off_road includes walls
};

/// coefficients: the agent's conditioning.
PICTURA_HD inline RewardTerms reward_terms(const StepFacts& facts, const float* coefficients, float dt_s) {
  const Motion& m = facts.motion;
  const auto coefficient = [coefficients](Conditioning which) { return coefficients[static_cast<int>(which)]; };
  const float v = m.speed_mps;
  const float angle = facts.fit.angle_rad;
  const float cos_angle = facts.fit.lane < 0 ? 0.0f : cos_of(angle);
  const float d = fabsf(facts.fit.offset_m - coefficient(Conditioning::center_bias_m));

  RewardTerms r;
  r.goal =
      facts.passed_waypoint || (facts.passed_last_waypoint && v < coefficient(Conditioning::v_goal_mps)) ? 1.0f : 0.0f;
  if (facts.collision) r.collision = -(coefficient(Conditioning::collision) + 0.1f * fabsf(v));
  if (facts.off_road) r.off_road = -coefficient(Conditioning::off_road);
  if (facts.red_light) r.stop_line = -coefficient(Conditioning::stop_line);
  const int harsh = (fabsf(m.accel_long_mps2) > 3.0f ? 1 : 0) + (fabsf(m.accel_lat_mps2) > 3.0f ? 1 : 0) +
                    (fabsf(m.jerk_long_mps3) > 5.0f || fabsf(m.jerk_lat_mps3) > 5.0f ? 1 : 0);
  r.comfort = -coefficient(Conditioning::comfort) * static_cast<float>(harsh);
  r.lane_align = coefficient(Conditioning::lane_align) * dt_s *
                 (min_of(cos_angle, 0.0f) + coefficient(Conditioning::vel_align) * min_of(v * cos_angle, 0.0f) +
                  0.0025f * (1.0f - (2.0f / kPi) * fabsf(angle)));
  r.lane_center =
      -coefficient(Conditioning::lane_center) * dt_s * ((cos_angle > 0.5f ? d : 0.0f) - 0.05f * exp_of(-(d - 0.5f)));
  if (v > 2.5f) r.velocity = coefficient(Conditioning::velocity) * dt_s * max_of(cos_angle, 0.0f);
  if (v < 0.0f) r.reverse = -coefficient(Conditioning::reverse) * dt_s;
  if (v > facts.fit.speed_limit_mps + 2.0f) r.overspeed = -coefficient(Conditioning::overspeed);
  if (v != 0.0f || m.accel_long_mps2 != 0.0f || m.accel_lat_mps2 != 0.0f) {
    r.timestep = -coefficient(Conditioning::timestep) * dt_s;
  }
  return r;
}

}  // namespace pictura
