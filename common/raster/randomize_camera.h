// Randomized cameras and image colours: functions of the view's key and the camera's index, bitwise equal on all
// devices. Values are drawn even if their range is 0, so that effects do not change each other.
#pragma once

#include "pictura/common/camera_randomization.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/raster/compositing.h"
#include "pictura/common/rng.h"

namespace pictura {

/// Random deviations of a camera in one episode.
struct CameraMounting {
  float yaw_rad = 0, pitch_rad = 0, roll_rad = 0;  // about the camera's axes, see Camera
  Vec3 shift_m;                                    // in the ego frame
  float focal_factor = 1, brightness_factor = 1;
  bool is_dead = false;
};

PICTURA_HD inline RandomStream camera_stream(const CameraRandomization& ranges, const ViewKey& key, uint32_t step,
                                             Purpose purpose) {
  return RandomStream({.seed = ranges.seed,
                       .world = key.world,
                       .agent = key.agent,
                       .episode = key.episode,
                       .step = step,
                       .purpose = purpose});
}

PICTURA_HD inline CameraMounting draw_mounting(const CameraRandomization& ranges, const ViewKey& key, int camera) {
  RandomStream random = camera_stream(ranges, key, static_cast<uint32_t>(camera), Purpose::camera_mounting);
  auto within = [&random](double range) { return random.uniform(-1.0f, 1.0f) * static_cast<float>(range); };
  const double rotation_rad = ranges.rotation_deg * (3.14159265358979323846 / 180.0);
  CameraMounting mounting;
  mounting.yaw_rad = within(rotation_rad);
  mounting.pitch_rad = within(rotation_rad);
  mounting.roll_rad = within(rotation_rad);
  mounting.shift_m.x = within(ranges.shift_m);
  mounting.shift_m.y = within(ranges.shift_m);
  mounting.shift_m.z = within(ranges.shift_m);
  mounting.focal_factor = 1.0f + within(ranges.focal_share);
  mounting.brightness_factor = 1.0f + within(ranges.brightness_share);
  mounting.is_dead = random.uniform() < static_cast<float>(ranges.dead_probability);
  return mounting;
}

/// Applies a mounting to a rig's camera.
PICTURA_HD inline PinholeCamera mounted(PinholeCamera camera, const CameraMounting& mounting) {
  // Turns axis a towards axis b.
  auto turn = [](Vec3* a, Vec3* b, float angle_rad) {
    const SinCos turned = sincos_of(angle_rad);
    const Vec3 before = *a;
    *a = before * turned.cos + *b * turned.sin;
    *b = *b * turned.cos - before * turned.sin;
  };
  turn(&camera.right, &camera.forward, mounting.yaw_rad);
  turn(&camera.down, &camera.forward, mounting.pitch_rad);
  turn(&camera.right, &camera.down, mounting.roll_rad);
  camera.position_m = camera.position_m + mounting.shift_m;
  camera.focal_x_px = camera.focal_x_px * mounting.focal_factor;
  camera.focal_y_px = camera.focal_y_px * mounting.focal_factor;
  return camera;
}

PICTURA_HD inline PinholeCamera randomized_camera(const PinholeCamera& in_ego, const CameraRandomization& ranges,
                                                  const ViewKey& key, int camera) {
  return ranges.moves_cameras() ? mounted(in_ego, draw_mounting(ranges, key, camera)) : in_ego;
}

/// Effect on an image's colours.
struct ImageEffect {
  bool is_on = false;
  float brightness_factor = 1, noise_per_unit = 0;
  uint32_t noise_key[2] = {};

  PICTURA_HD Rgb of(Rgb color, int x, int y) const {
    Philox4 random{};
    if (noise_per_unit > 0) {  // noise takes most of the time
      random = philox4x32_10({{static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0, 0}}, noise_key[0], noise_key[1]);
    }
    auto channel = [&](float value, uint32_t bits) {
      return saturate(value * brightness_factor + noise_per_unit * static_cast<float>(noise_units(bits)));
    };
    return {channel(color.r, random.word[0]), channel(color.g, random.word[1]), channel(color.b, random.word[2])};
  }
  /// Applies the effect to packed bytes, see to_bytes().
  PICTURA_HD uint32_t of_bytes(uint32_t color, int x, int y) const { return to_bytes(of(rgb_of_bytes(color), x, y)); }

  /// Standard deviation of noise_units().
  static constexpr float kNoiseDeviation = 147.8005413f;
  /// Approximately normal noise: the sum of four uniform bytes, minus its mean.
  PICTURA_HD static constexpr int noise_units(uint32_t bits) {
    return static_cast<int>((bits & 255u) + (bits >> 8 & 255u) + (bits >> 16 & 255u) + (bits >> 24)) - 510;
  }
};

PICTURA_HD inline ImageEffect image_effect(const CameraRandomization& ranges, const ViewKey& key, int camera) {
  if (!ranges.changes_colors()) return {};
  const CameraMounting mounting = draw_mounting(ranges, key, camera);
  RandomStream random = camera_stream(ranges, key, key.step, Purpose::camera_frame);
  constexpr int kDraws = 4;
  random.skip(kDraws * camera);
  const bool is_dropped = random.uniform() < static_cast<float>(ranges.dropped_probability);
  ImageEffect effect{.is_on = true};
  effect.noise_key[0] = random.bits();
  effect.noise_key[1] = random.bits();
  const bool is_black = mounting.is_dead || is_dropped;
  effect.brightness_factor = is_black ? 0.0f : mounting.brightness_factor;
  effect.noise_per_unit =
      is_black ? 0.0f : static_cast<float>(ranges.noise_share) * (1.0f / ImageEffect::kNoiseDeviation);
  return effect;
}

}  // namespace pictura
