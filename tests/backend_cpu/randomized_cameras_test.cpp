// Images of randomized cameras. Each equals the image of a rig that is mounted with the random changes, after the
// effect on its colours. The result does not depend on the order or time of drawing.
#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/raster/randomize_camera.h"
#include "pictura/common/scene_history.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/keyed_views.h"

namespace pictura {
namespace {

using test::keyed;
using test::message_of;

std::vector<uint8_t> drawn(const Snapshot& town, const std::vector<View>& views, const RendererConfig& config,
                           PixelFormat format = PixelFormat::u8, ChannelOrder order = ChannelOrder::planar) {
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, town.geometry);
  HostImages images(config.rig, static_cast<int>(views.size()), format, Planes::none, order);
  renderer->render(town.scene.batch(), views, images.batch());
  return {images.bytes().begin(), images.bytes().end()};
}

Snapshot town_with_views(int count) {
  Snapshot town = make_synthetic_town(3, 80);
  town.views.resize(static_cast<std::size_t>(count));
  town.views = keyed(town.views);
  return town;
}

RendererConfig randomized(const CameraRandomization& ranges, const Rig& rig = paper_rig()) {
  return {.rig = rig, .num_threads = 1, .randomization = ranges};
}

TEST(RandomizedImages, ViewKeysChangeNoImageWithoutRandomization) {
  const Snapshot town = town_with_views(3);
  std::vector<View> unkeyed = town.views;
  for (View& view : unkeyed) view.key = {};
  EXPECT_EQ(drawn(town, town.views, randomized({})), drawn(town, unkeyed, randomized({})));
}

// Shifts and focal lengths are exact; angles are turned in float, those of rigs in double.
TEST(RandomizedImages, EqualImagesOfARigWithTheDrawnMounting) {
  const Snapshot town = town_with_views(1);
  const CameraRandomization moved{.seed = 9, .shift_m = 0.3, .focal_share = 0.2};
  Rig rig = paper_rig();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraMounting mounting = draw_mounting(moved, town.views[0].key, static_cast<int>(i));
    Camera& camera = rig.cameras[i];
    camera.position_m = camera.position_m + mounting.shift_m;
    camera.focal_x_px *= mounting.focal_factor;
    camera.focal_y_px *= mounting.focal_factor;
  }
  EXPECT_EQ(drawn(town, town.views, randomized(moved)), drawn(town, town.views, randomized({}, rig)));
  EXPECT_NE(drawn(town, town.views, randomized(moved)), drawn(town, town.views, randomized({})));
}

TEST(RandomizedImages, EqualImagesOfARigWithTheDrawnAngles) {
  const Snapshot town = town_with_views(1);
  const CameraRandomization turned{.rotation_deg = 8};
  Rig rig = front_rig(), expected_rig = rig;
  const CameraMounting mounting = draw_mounting(turned, town.views[0].key, 0);
  expected_rig.cameras[0].yaw_rad += mounting.yaw_rad;
  expected_rig.cameras[0].pitch_rad += mounting.pitch_rad;
  expected_rig.cameras[0].roll_rad += mounting.roll_rad;
  const std::vector<uint8_t> image = drawn(town, town.views, randomized(turned, rig)),
                             expected = drawn(town, town.views, randomized({}, expected_rig));
  int far_off = 0;
  for (std::size_t i = 0; i < image.size(); ++i) far_off += std::abs(int{image[i]} - int{expected[i]}) > 2;
  EXPECT_LT(far_off, 20);  // the images have 15,552 values
}

// Minibatches and films redraw earlier views from a history: other views, in another order.
TEST(RandomizedImages, AreReproducedFromAHistory) {
  const Snapshot town = town_with_views(4);
  const std::size_t agents = town.scene.agents.size(), lights = town.scene.light_states.size();
  const auto history = make_host_scene_history(
      {.num_steps = 2, .worlds = 1, .agents = agents, .lights = lights, .views = town.views.size()});
  std::vector<View> later = town.views;
  for (View& view : later) ++view.key.step;
  history->put(0, town.scene.batch(), town.views);
  history->put(1, town.scene.batch(), later);
  const RendererConfig config = randomized(kFullCameraSeverity);
  const std::vector<uint8_t> first = drawn(town, town.views, config), second = drawn(town, later, config);
  EXPECT_NE(first, second);
  const std::vector<int64_t> rows{6, 1};
  std::vector<View> gathered(rows.size());
  history->gather(rows, gathered);
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, town.geometry);
  HostImages images(config.rig, 2);
  renderer->render(history->scene(), gathered, images.batch());
  const std::size_t bytes = first.size() / town.views.size();
  EXPECT_TRUE(std::equal(images.bytes().begin(), images.bytes().begin() + bytes, second.begin() + 2 * bytes));
  EXPECT_TRUE(std::equal(images.bytes().begin() + bytes, images.bytes().end(), first.begin() + bytes));
}

TEST(RandomizedImages, ApplyBrightnessAndNoiseToEachPixel) {
  const Snapshot town = town_with_views(1);
  const CameraRandomization ranges{.seed = 4, .brightness_share = 0.5, .noise_share = 0.2};
  const Rig rig = front_rig(13, 7);  // patches extend beyond this image
  const ImageEffect effect = image_effect(ranges, town.views[0].key, 0);
  const std::vector<uint8_t> plain = drawn(town, town.views, randomized({}, rig)),
                             seen = drawn(town, town.views, randomized(ranges, rig)),
                             patches = drawn(town, town.views, randomized(ranges, rig), PixelFormat::u8,
                                             ChannelOrder::patches);
  constexpr std::size_t kPixels = 13 * 7;
  std::size_t lit = 0;
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 13; ++x) {
      const auto at = static_cast<std::size_t>(y * 13 + x);
      const uint32_t color =
          uint32_t{plain[at]} | uint32_t{plain[at + kPixels]} << 8 | uint32_t{plain[at + 2 * kPixels]} << 16;
      const uint32_t expected = effect.of_bytes(color, x, y);
      for (int channel = 0; channel < 3; ++channel) {
        const auto byte = static_cast<uint8_t>(expected >> (8 * channel));
        EXPECT_EQ(seen[at + static_cast<std::size_t>(channel) * kPixels], byte);
        EXPECT_EQ(patches[static_cast<std::size_t>(place_in_patches(kDefaultPatch_px, 13, channel, x, y))], byte);
        lit += byte != 0;
      }
    }
  }
  // Patches are black beyond the image.
  EXPECT_EQ(patches.size() - static_cast<std::size_t>(std::ranges::count(patches, uint8_t{0})), lit);
}

TEST(RandomizedImages, DeadCamerasHaveBlackImagesAndValidPlanes) {
  const Snapshot town = town_with_views(1);
  const RendererConfig config = randomized({.noise_share = 0.1, .dead_probability = 1});
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, town.geometry);
  HostImages images(config.rig, 1, PixelFormat::u8, Planes::all);
  renderer->render(town.scene.batch(), town.views, images.batch());
  EXPECT_TRUE(std::ranges::all_of(images.bytes(), [](uint8_t byte) { return byte == 0; }));
  const uint8_t* classes = images.camera(0).class_id;
  EXPECT_TRUE(std::any_of(classes, classes + 96 * 54, [](uint8_t id) { return id != 0; }));
}

TEST(RandomizedImages, RangesOutOfBoundsAreRefused) {
  EXPECT_EQ(message_of([] { make_renderer("cpu", randomized({.rotation_deg = 46})); }),
            "renderer cpu: randomization: rotation_deg: expected 0 to 45, got 46");
  EXPECT_EQ(message_of([] { make_renderer("cpu", randomized({.dead_probability = -0.5})); }),
            "renderer cpu: randomization: dead_probability: expected 0 to 1, got -0.5");
}

}  // namespace
}  // namespace pictura
