// Randomization of a rig's cameras and of their images. Training with randomized cameras makes policies robust;
// evaluations test policies at given deviations. common/raster/randomize_camera.h draws the random values.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Ranges of the random values, which are drawn once per episode and camera unless noted otherwise. If all ranges are
/// 0, nothing is randomized.
struct CameraRandomization {
  uint64_t seed = 0;
  double rotation_deg = 0;         // yaw, pitch and roll about the camera's own axes: uniform in +-rotation_deg
  double shift_m = 0;              // along each axis of the ego frame: uniform in +-shift_m
  double focal_share = 0;          // factor on both focal lengths: uniform in 1 +- focal_share
  double brightness_share = 0;     // factor on all channels: uniform in 1 +- brightness_share
  double noise_share = 0;          // noise of a channel per step: standard deviation as a share of full brightness
  double dead_probability = 0;     // probability that a camera is black for the episode
  double dropped_probability = 0;  // probability that an image is black in one step

  /// Whether the poses or focal lengths of cameras vary.
  PICTURA_HD constexpr bool moves_cameras() const { return rotation_deg > 0 || shift_m > 0 || focal_share > 0; }
  /// Whether the colours of images vary.
  PICTURA_HD constexpr bool changes_colors() const {
    return brightness_share > 0 || noise_share > 0 || dead_probability > 0 || dropped_probability > 0;
  }
  PICTURA_HD constexpr bool is_on() const { return moves_cameras() || changes_colors(); }
  bool operator==(const CameraRandomization&) const = default;
};

/// Upper bounds of the ranges. Within them, cameras stay near their mounting, and no brightness factor is negative.
constexpr CameraRandomization kMaxCameraRandomization{.rotation_deg = 45,
                                                      .shift_m = 1,
                                                      .focal_share = 0.5,
                                                      .brightness_share = 1,
                                                      .noise_share = 1,
                                                      .dead_probability = 1,
                                                      .dropped_probability = 1};

/// Ranges of an evaluation at severity 1; other severities scale them. docs/explanation/cameras.md explains the values.
constexpr CameraRandomization kFullCameraSeverity{.rotation_deg = 6,
                                                  .shift_m = 0.2,
                                                  .focal_share = 0.1,
                                                  .brightness_share = 0.5,
                                                  .noise_share = 0.1,
                                                  .dead_probability = 0.1,
                                                  .dropped_probability = 0.1};

/// Maximum severity of an evaluation. At this severity, all ranges are within kMaxCameraRandomization.
constexpr double kMaxCameraSeverity = 2;

/// Scales all ranges by a factor. The random draws do not change: a camera turns in the same direction, by a scaled
/// angle.
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
