// The 17 coefficients of each agent's reward and dynamics (paper, table of the conditioning coefficients).
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

enum class Conditioning : int32_t {
  delta_goal_m,
  v_goal_mps,
  collision,
  off_road,
  stop_line,
  comfort,
  lane_align,
  vel_align,
  lane_center,
  center_bias_m,
  velocity,
  reverse,
  overspeed,
  timestep,  // the first 14: reward
  throttle,
  steer,
  acceleration,  // the last 3: dynamics
};
constexpr int kNumConditioning = 17;
constexpr int kNumRewardConditioning = 14;

/// U(low, high) or, if `mixture`, U(low, 1) or U(1, high) with equal probability.
struct ConditioningRange {
  float low, high;
  bool mixture;
};

constexpr ConditioningRange kPaperConditioning[kNumConditioning] = {
    {2.0f, 12.0f, false},      {0.0f, 20.0f, false},      {0.0f, 3.0f, false},       {0.0f, 3.0f, false},
    {0.0f, 1.0f, false},       {0.0f, 0.1f, false},       {2.5e-4f, 2.5e-2f, false}, {0.0f, 1.0f, false},
    {2.5e-4f, 7.5e-3f, false}, {-0.5f, 0.5f, false},      {2.5e-3f, 2.5e-3f, false}, {2.5e-4f, 7.5e-3f, false},
    {0.0f, 1.0f, false},       {2.5e-5f, 2.5e-5f, false}, {0.8f, 1.25f, true},       {0.8f, 1.25f, true},
    {2.0f / 3.0f, 1.5f, true},
};

/// Names in configuration files and tables.
constexpr const char* kConditioningNames[kNumConditioning] = {
    "delta_goal_m", "v_goal_mps", "collision",   "off_road",      "stop_line",    "comfort",
    "lane_align",   "vel_align",  "lane_center", "center_bias_m", "velocity",     "reverse",
    "overspeed",    "timestep",   "throttle",    "steer",         "acceleration",
};

}  // namespace pictura
