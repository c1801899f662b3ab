// Settings of randomized cameras (common/raster/randomize_camera.h).
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Ranges of random values. Values are drawn once per episode and camera unless noted otherwise.
struct CameraRandomization {
  uint64_t seed = 0;
  double rotation_deg = 0;         // yaw, pitch and roll about the camera's axes: uniform in +-rotation_deg
  double shift_m = 0;              // along each axis of the ego frame: uniform in +-shift_m
  double focal_share = 0;          // factor on both focal lengths: uniform in 1 +- focal_share
  double brightness_share = 0;     // factor on all channels: uniform in 1 +- brightness_share
  double noise_share = 0;          // noise per step and channel: standard deviation, as a share of full brightness
  double dead_probability = 0;     // probability of a black camera for an episode
  double dropped_probability = 0;  // probability of a black image in a step

  PICTURA_HD constexpr bool moves_cameras() const { return rotation_deg > 0 || shift_m > 0 || focal_share > 0; }
  PICTURA_HD constexpr bool changes_colors() const {
    return brightness_share > 0 || noise_share > 0 || dead_probability > 0 || dropped_probability > 0;
  }
  PICTURA_HD constexpr bool is_on() const { return moves_cameras() || changes_colors(); }
  bool operator==(const CameraRandomization&) const = default;
};

/// Upper bounds of the ranges.
constexpr CameraRandomization kMaxCameraRandomization{.rotation_deg = 45,
                                                      .shift_m = 1,
                                                      .focal_share = 0.5,
                                                      .brightness_share = 1,
                                                      .noise_share = 1,
                                                      .dead_probability = 1,
                                                      .dropped_probability = 1};

/// Ranges of an evaluation at severity 1 (docs/explanation/cameras.md). Other severities scale them.
constexpr CameraRandomization kFullCameraSeverity{.rotation_deg = 6,
                                                  .shift_m = 0.2,
                                                  .focal_share = 0.1,
                                                  .brightness_share = 0.5,
                                                  .noise_share = 0.1,
                                                  .dead_probability = 0.1,
                                                  .dropped_probability = 0.1};

/// Maximum severity of an evaluation.
constexpr double kMaxCameraSeverity = 2;

/// Scales all ranges. The underlying random draws do not change.
PICTURA_HD constexpr CameraRandomization scaled(CameraRandomization ranges, double factor) {
  ranges.rotation_deg *= factor;
  ranges.shift_m *= factor;
  ranges.focal_share *= factor;
  ranges.brightness_share *= factor;
  ranges.noise_share *= factor;
  ranges.dead_probability *= factor;
  ranges.dropped_probability *= factor;
  return ranges;
}

}  // namespace pictura
