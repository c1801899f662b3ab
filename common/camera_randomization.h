// How much the cameras of a rig, and their images, are randomized: a robust policy is trained with cameras that are not
// mounted as drawn, and evaluated by how much they are not. The rule is in common/raster/randomize_camera.h.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Ranges of what is drawn per episode and camera, and of what is drawn per step. All 0: images are as drawn.
struct CameraRandomization {
  uint64_t seed = 0;
  double rotation_deg = 0;         // yaw, pitch and roll about the camera's own axes: uniform within +- this
  double shift_m = 0;              // along each axis of the ego frame: uniform within +- this
  double focal_share = 0;          // both focal lengths times a factor, uniform within 1 +- this
  double brightness_share = 0;     // all channels times a factor, uniform within 1 +- this
  double noise_share = 0;          // standard deviation of a channel's noise in each step, of full brightness
  double dead_probability = 0;     // of a camera that is black for the episode
  double dropped_probability = 0;  // of an image that is black in one step

  /// Whether a camera's pose or focal length differs.
  PICTURA_HD constexpr bool moves_cameras() const { return rotation_deg > 0 || shift_m > 0 || focal_share > 0; }
  /// Whether the colours of images differ.
  PICTURA_HD constexpr bool changes_colors() const {
    return brightness_share > 0 || noise_share > 0 || dead_probability > 0 || dropped_probability > 0;
  }
  PICTURA_HD constexpr bool is_on() const { return moves_cameras() || changes_colors(); }
  bool operator==(const CameraRandomization&) const = default;
};

/// Upper bounds of the ranges: cameras stay near their place, and images are not inverted.
constexpr CameraRandomization kMaxCameraRandomization{.rotation_deg = 45,
                                                      .shift_m = 1,
                                                      .focal_share = 0.5,
                                                      .brightness_share = 1,
                                                      .noise_share = 1,
                                                      .dead_probability = 1,
                                                      .dropped_probability = 1};

/// Severity 1 of evaluations (docs/explanation/cameras.md says why these numbers).
constexpr CameraRandomization kFullCameraSeverity{.rotation_deg = 6,
                                                  .shift_m = 0.2,
                                                  .focal_share = 0.1,
                                                  .brightness_share = 0.5,
                                                  .noise_share = 0.1,
                                                  .dead_probability = 0.1,
                                                  .dropped_probability = 0.1};

/// Upper bound of severities: no range exceeds its own.
constexpr double kMaxCameraSeverity = 2;

/// All ranges times a factor. The draws stay the same: a camera turns in the same direction, less or more.
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
