// Randomized cameras: the random numbers, their keys, and the mounting of a camera that follows from them.
#include "pictura/common/raster/randomize_camera.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/common/camera.h"
#include "pictura/common/raster/check.h"

namespace pictura {
namespace {

constexpr ViewKey kKey{.world = 5, .agent = 7, .episode = 2, .step = 40};

void expect_near(Vec3 actual, Vec3 expected) {
  EXPECT_NEAR(actual.x, expected.x, 1e-6f);
  EXPECT_NEAR(actual.y, expected.y, 1e-6f);
  EXPECT_NEAR(actual.z, expected.z, 1e-6f);
}

TEST(RandomizedCamera, RotatesAsAnglesOfARigDo) {
  // Rotated from no pose, a camera has the axes of a rig's camera with these angles.
  const Camera straight{.width_px = 8, .height_px = 8, .focal_x_px = 4, .focal_y_px = 4};
  Camera turned = straight;
  turned.yaw_rad = 0.3f;
  turned.pitch_rad = -0.2f;
  turned.roll_rad = 0.1f;
  CameraMounting mounting;
  mounting.yaw_rad = turned.yaw_rad;
  mounting.pitch_rad = turned.pitch_rad;
  mounting.roll_rad = turned.roll_rad;
  mounting.shift_m = {0.1f, -0.2f, 0.3f};
  mounting.focal_factor = 1.5f;
  const PinholeCamera camera = mounted(pinhole_cameras({{straight}})[0], mounting);
  const CameraAxes expected = camera_axes(turned);
  expect_near(camera.right, expected.right);
  expect_near(camera.down, expected.down);
  expect_near(camera.forward, expected.forward);
  expect_near(camera.position_m, {0.1f, -0.2f, 0.3f});
  EXPECT_EQ(camera.focal_x_px, 6.0f);
  EXPECT_EQ(camera.focal_y_px, 6.0f);
}

TEST(RandomizedCamera, NothingIsRandomByDefault) {
  const CameraRandomization off{.seed = 3};
  EXPECT_FALSE(off.is_on());
  EXPECT_FALSE(scaled(kFullCameraSeverity, 0).is_on());
  EXPECT_FALSE(image_effect(off, kKey, 0).is_on);
  const PinholeCamera in_ego = pinhole_cameras(paper_rig())[1];
  const PinholeCamera camera = randomized_camera(in_ego, off, kKey, 1);
  EXPECT_EQ(camera.position_m.x, in_ego.position_m.x);
  EXPECT_EQ(camera.forward.x, in_ego.forward.x);
  EXPECT_EQ(camera.focal_x_px, in_ego.focal_x_px);
}

TEST(RandomizedCamera, EveryMountingIsDrawnWithinItsRange) {
  constexpr CameraRandomization kRanges = kFullCameraSeverity;
  const auto rotation_rad = static_cast<float>(kRanges.rotation_deg * 3.141592653589793 / 180);
  const auto shift_m = static_cast<float>(kRanges.shift_m), focal = static_cast<float>(kRanges.focal_share),
             brightness = static_cast<float>(kRanges.brightness_share);
  struct Seen {
    double sum = 0, low = 1, high = -1;
  } seen[8];
  constexpr int kAgents = 4000;
  int dead = 0;
  for (uint32_t agent = 0; agent < kAgents; ++agent) {
    const CameraMounting one = draw_mounting(kRanges, {.world = 1, .agent = agent}, 2);
    const float parts[] = {one.yaw_rad / rotation_rad,        one.pitch_rad / rotation_rad,
                           one.roll_rad / rotation_rad,       one.shift_m.x / shift_m,
                           one.shift_m.y / shift_m,           one.shift_m.z / shift_m,
                           (one.focal_factor - 1.0f) / focal, (one.brightness_factor - 1.0f) / brightness};
    for (int i = 0; i < 8; ++i) {
      const double part = parts[i];
      seen[i] = {seen[i].sum + part, std::min(seen[i].low, part), std::max(seen[i].high, part)};
    }
    dead += one.is_dead;
  }
  for (const Seen& one : seen) {
    EXPECT_NEAR(one.sum / kAgents, 0, 0.03);
    EXPECT_NEAR(one.low, -1, 0.01);
    EXPECT_NEAR(one.high, 1, 0.01);
  }
  EXPECT_NEAR(static_cast<double>(dead) / kAgents, kRanges.dead_probability, 0.02);
}

TEST(RandomizedCamera, AMountingLastsForAnEpisodeOfAnAgentsCamera) {
  auto yaw_of = [](const ViewKey& key, int camera, uint64_t seed = 1) {
    CameraRandomization ranges = kFullCameraSeverity;
    ranges.seed = seed;
    return draw_mounting(ranges, key, camera).yaw_rad;
  };
  ViewKey later = kKey;
  ++later.step;
  EXPECT_EQ(yaw_of(later, 0), yaw_of(kKey, 0));
  for (uint32_t ViewKey::* const id : {&ViewKey::world, &ViewKey::agent, &ViewKey::episode}) {
    ViewKey other = kKey;
    ++(other.*id);
    EXPECT_NE(yaw_of(other, 0), yaw_of(kKey, 0));
  }
  EXPECT_NE(yaw_of(kKey, 1), yaw_of(kKey, 0));
  EXPECT_NE(yaw_of(kKey, 0, 2), yaw_of(kKey, 0));
}

// Runs with different severities therefore differ in nothing else.
TEST(RandomizedCamera, HalfTheSeverityHalvesTheSameDraws) {
  const CameraMounting whole = draw_mounting(kFullCameraSeverity, kKey, 3),
                       half = draw_mounting(scaled(kFullCameraSeverity, 0.5), kKey, 3);
  EXPECT_FLOAT_EQ(half.yaw_rad, 0.5f * whole.yaw_rad);
  EXPECT_FLOAT_EQ(half.shift_m.z, 0.5f * whole.shift_m.z);
  EXPECT_NEAR(half.focal_factor - 1, 0.5f * (whole.focal_factor - 1), 1e-6f);
  const ImageEffect full_effect = image_effect(kFullCameraSeverity, kKey, 3),
                    half_effect = image_effect(scaled(kFullCameraSeverity, 0.5), kKey, 3);
  EXPECT_EQ(half_effect.noise_key[0], full_effect.noise_key[0]);
  EXPECT_EQ(half_effect.noise_key[1], full_effect.noise_key[1]);
}

TEST(RandomizedCamera, ImagesAreDroppedAtTheConfiguredRate) {
  const CameraRandomization ranges{.dropped_probability = 0.25};
  constexpr int kSteps = 4000;
  int black = 0;
  for (uint32_t step = 0; step < kSteps; ++step) {
    const ImageEffect effect = image_effect(ranges, {.agent = 3, .step = step}, 1);
    EXPECT_TRUE(effect.is_on);
    black += effect.brightness_factor == 0;
  }
  EXPECT_NEAR(static_cast<double>(black) / kSteps, 0.25, 0.03);
}

TEST(RandomizedCamera, ADeadCameraIsBlackInEveryStep) {
  const CameraRandomization ranges{.noise_share = 0.5, .dead_probability = 1};
  for (uint32_t step = 0; step < 10; ++step) {
    EXPECT_EQ(image_effect(ranges, {.step = step}, 0).of_bytes(0x80FF40u, 3, 4), 0u);
  }
}

TEST(RandomizedCamera, NoiseHasItsDeviationAndDiffersByStepAndCamera) {
  const CameraRandomization ranges{.noise_share = 0.1};
  const Rgb grey{0.5f, 0.5f, 0.5f};
  double sum = 0, squares = 0;
  constexpr int kPixels = 20'000;
  const ImageEffect effect = image_effect(ranges, kKey, 0);
  for (int x = 0; x < kPixels; ++x) {
    const Rgb seen = effect.of(grey, x, 5);
    for (const float channel : {seen.r, seen.g, seen.b}) {
      sum += static_cast<double>(channel) - 0.5;
      squares += (static_cast<double>(channel) - 0.5) * (static_cast<double>(channel) - 0.5);
    }
  }
  EXPECT_NEAR(sum / (3 * kPixels), 0, 0.002);
  EXPECT_NEAR(std::sqrt(squares / (3 * kPixels)), 0.1, 0.002);
  EXPECT_NE(effect.of(grey, 1, 2).r, effect.of(grey, 1, 2).g);
  ViewKey later = kKey;
  ++later.step;
  EXPECT_NE(image_effect(ranges, later, 0).of(grey, 1, 2).r, effect.of(grey, 1, 2).r);
  EXPECT_NE(image_effect(ranges, kKey, 1).of(grey, 1, 2).r, effect.of(grey, 1, 2).r);
}

TEST(RandomizedCamera, BrightnessScalesBytes) {
  ImageEffect effect{.is_on = true, .brightness_factor = 0.5f};
  EXPECT_EQ(effect.of_bytes(0x0080FEu, 0, 0), 0x00407Fu);
  effect.brightness_factor = 2;
  EXPECT_EQ(effect.of_bytes(0x1080FFu, 0, 0), 0x20FFFFu);
}

// A seed identifies a run, so its draws must not change.
TEST(RandomizedCamera, DrawsEqualThoseOfEarlierVersions) {
  const CameraMounting mounting = draw_mounting(kFullCameraSeverity, kKey, 1);
  EXPECT_EQ(mounting.yaw_rad, 0.09573058f);
  EXPECT_EQ(mounting.shift_m.y, -0.096921921f);
  EXPECT_EQ(mounting.brightness_factor, 1.4549406f);
  EXPECT_EQ(image_effect(kFullCameraSeverity, kKey, 1).noise_key[0], 2311479751u);
  EXPECT_EQ(image_effect(kFullCameraSeverity, kKey, 1).of_bytes(0x808080u, 3, 4), 14063318u);
}

}  // namespace
}  // namespace pictura
