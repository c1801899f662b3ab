// Checks of the guarantees of all renderers, for callers with host memory.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/renderer.h"
#include "pictura/tests/support/error_message.h"

namespace pictura::test {

using MakeForRig = std::function<std::unique_ptr<Renderer>(const Rig& rig)>;

/// Returns the bytes of a town's images. The map must be at the handle of the scene's world.
inline std::vector<uint8_t> draw_town(Renderer* renderer, const SceneOwner& scene, const std::vector<View>& views) {
  HostImages images(renderer->config().rig, static_cast<int>(views.size()));
  std::ranges::fill(images.bytes(), uint8_t{0xA5});
  renderer->render(scene.batch(), views, images.batch());
  renderer->check();
  return {images.bytes().begin(), images.bytes().end()};
}

/// Expects that maps can be replaced and released by handle, and that renderers can share a scene.
inline void expect_maps_by_handle(const MakeForRig& make) {
  const Rig rig = front_rig(32, 18);
  Snapshot town = make_synthetic_town(1, 20);
  const Snapshot other = make_synthetic_town(2, 20);
  town.views.resize(2);
  auto named = [&](GeometryHandle handle) {
    SceneOwner scene = town.scene;
    scene.geometry[0] = handle;
    return scene;
  };
  const auto first = make(rig), second = make(rig), only_other = make(rig);
  first->upload(0, town.geometry);
  only_other->upload(3, other.geometry);
  const std::vector<uint8_t> expected = draw_town(first.get(), named(0), town.views);
  const std::vector<uint8_t> expected_other = draw_town(only_other.get(), named(3), town.views);
  ASSERT_NE(expected, expected_other);

  constexpr GeometryHandle kLast = kNumGeometryHandles - 1;
  second->upload(kLast, other.geometry);
  second->upload(7, town.geometry);
  EXPECT_EQ(draw_town(second.get(), named(7), town.views), expected);
  EXPECT_EQ(draw_town(second.get(), named(kLast), town.views), expected_other);
  first->upload(7, town.geometry);
  const SceneOwner shared = named(7);
  EXPECT_EQ(draw_town(first.get(), shared, town.views), draw_town(second.get(), shared, town.views));
  second->upload(7, other.geometry);
  EXPECT_EQ(draw_town(second.get(), shared, town.views), expected_other);
  EXPECT_EQ(draw_town(first.get(), shared, town.views), expected);
  // Releases a map twice. Other maps are unchanged.
  second->release(7);
  second->release(7);
  for (const GeometryHandle empty : {7, 8, kNumGeometryHandles, -1}) {
    EXPECT_THAT(message_of([&] { draw_town(second.get(), named(empty), town.views); }),
                testing::AnyOf(testing::HasSubstr("world 0: expected a handle that holds a geometry, got"),
                               testing::HasSubstr("its world has no such geometry")));
  }
  EXPECT_EQ(draw_town(second.get(), named(kLast), town.views), expected_other);
  second->upload(7, town.geometry);
  EXPECT_EQ(draw_town(second.get(), shared, town.views), expected);
}

/// Expects an error naming the handle for each handle out of range.
inline void expect_refused_handles(const MakeForRig& make) {
  const auto renderer = make(front_rig(8, 8));
  const StaticGeometry geometry = make_synthetic_town(1, 1).geometry;
  for (const GeometryHandle handle : {-1, 65536}) {
    const std::string told = "geometry: expected a handle of 0 to 65535, got " + std::to_string(handle);
    EXPECT_THAT(message_of([&] { renderer->upload(handle, geometry); }), testing::HasSubstr(told));
    EXPECT_THAT(message_of([&] { renderer->release(handle); }), testing::HasSubstr(told));
  }
}

/// Converts planar images to patches, which are black beyond the images.
inline std::vector<uint8_t> as_patches(const HostImages& planar, const ImageLayout& layout) {
  const std::size_t size = bytes_per_value(layout.format);
  std::vector<uint8_t> result(layout.bytes());
  for (std::size_t k = 0; k < layout.cameras.size(); ++k) {
    const CameraLayout &from = planar.layout().cameras[k], &to = layout.cameras[k];
    for (int64_t view = 0; view < layout.num_views; ++view) {
      for (int channel = 0; channel < 3; ++channel) {
        for (int y = 0; y < from.size.height_px; ++y) {
          for (int x = 0; x < from.size.width_px; ++x) {
            const int64_t source = from.offset + view * from.view_stride + channel * from.channel_stride +
                                   y * from.row_stride + x * from.pixel_stride;
            const int64_t target = to.offset + view * to.view_stride +
                                   place_in_patches(layout.patch_px, from.size.width_px, channel, x, y);
            std::memcpy(&result[static_cast<std::size_t>(target) * size],
                        &planar.bytes()[static_cast<std::size_t>(source) * size], size);
          }
        }
      }
    }
  }
  return result;
}

/// Expects that patches contain the values of planar images, and black beyond, and that bf16 images contain the values
/// of u8 images.
inline void expect_patches(const MakeForRig& make) {
  Rig rig = paper_rig(33, 19);  // neither side is a multiple of a patch's side
  rig.cameras[1] = paper_rig(32, 18).cameras[1];
  rig.cameras[2] = paper_rig(6, 24).cameras[2];
  Snapshot town = make_synthetic_town(2, 40);
  town.views.resize(2);
  const auto renderer = make(rig);
  ASSERT_TRUE(renderer->draws_all_formats());
  renderer->upload(0, town.geometry);
  const auto drawn = [&](PixelFormat format, ChannelOrder order, int patch_px = kDefaultPatch_px) {
    HostImages images(rig, 2, format, Planes::none, order, patch_px);
    std::ranges::fill(images.bytes(), uint8_t{0xA5});
    renderer->render(town.scene.batch(), town.views, images.batch());
    renderer->check();
    return images;
  };
  for (const PixelFormat format : {PixelFormat::u8, PixelFormat::f16, PixelFormat::f32, PixelFormat::bf16}) {
    const HostImages planar = drawn(format, ChannelOrder::planar);
    for (const int patch_px : {4, 8, 12, 16}) {
      const HostImages patches = drawn(format, ChannelOrder::patches, patch_px);
      EXPECT_TRUE(std::ranges::equal(patches.bytes(), as_patches(planar, patches.layout())))
          << static_cast<int>(format) << ", " << patch_px;
    }
  }
  const HostImages bytes = drawn(PixelFormat::u8, ChannelOrder::planar),
                   floats = drawn(PixelFormat::bf16, ChannelOrder::planar);
  for (std::size_t i = 0; i < bytes.bytes().size(); ++i) {
    uint16_t bits = 0;
    std::memcpy(&bits, &floats.bytes()[2 * i], 2);
    ASSERT_EQ(std::bit_cast<float>(uint32_t{bits} << 16), static_cast<float>(bytes.bytes()[i])) << i;
  }
}

/// Expects an error naming the order, the patch size or the format of each unsupported request.
inline void expect_refused_order(const MakeForRig& make) {
  const Rig rig = front_rig(8, 8);
  HostImages images(rig, 1);
  ImageBatch batch = images.batch();
  batch.order = ChannelOrder::interleaved;
  const std::vector<View> views(1);
  const auto renderer = make(rig);
  EXPECT_THAT(message_of([&] { renderer->render({}, views, batch); }),
              testing::ContainsRegex("images: expected the channel order planar.*, got interleaved"));
  if (renderer->draws_all_formats()) {
    batch.order = ChannelOrder::patches;
    batch.patch_px = 6;
    EXPECT_THAT(message_of([&] { renderer->render({}, views, batch); }),
                testing::HasSubstr("images: expected patches of 4, 8, 12 or 16 pixels squared, got 6"));
    return;
  }
  HostImages patches(rig, 1, PixelFormat::u8, Planes::none, ChannelOrder::patches);
  EXPECT_THAT(message_of([&] { renderer->render({}, views, patches.batch()); }),
              testing::HasSubstr("images: expected the channel order planar, got patches"));
  HostImages halves(rig, 1, PixelFormat::bf16);
  EXPECT_THAT(message_of([&] { renderer->render({}, views, halves.batch()); }),
              testing::HasSubstr("images: expected the format u8 or f32, got bf16"));
}

/// Expects that drawing the first `count` views neither writes nor reads later views.
inline void expect_counted_views(const MakeForRig& make) {
  const Rig rig = paper_rig(24, 14);
  Snapshot town = make_synthetic_town(1, 20);
  town.views.resize(5);
  const auto renderer = make(rig);
  renderer->upload(0, town.geometry);
  std::vector<View> list{town.views[1], town.views[3], town.views[4], {}, {}};
  list[3].world = list[4].world = 1'000'000;
  for (const int32_t count : {3, 2, 0}) {
    const std::vector<View> exactly(list.begin(), list.begin() + count);
    const std::vector<uint8_t> expected = draw_town(renderer.get(), town.scene, exactly);
    HostImages images(rig, 5);
    std::ranges::fill(images.bytes(), uint8_t{0xA5});
    renderer->render(town.scene.batch(), {list, &count}, images.batch());
    renderer->check();
    const auto written = static_cast<std::ptrdiff_t>(expected.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), images.bytes().begin())) << count;
    EXPECT_TRUE(std::all_of(images.bytes().begin() + written, images.bytes().end(), [](uint8_t byte) {
      return byte == 0xA5;
    })) << count;
  }
  for (const int32_t count : {-1, 6}) {
    HostImages images(rig, 5);
    const std::vector<View> sound(5, town.views[0]);
    EXPECT_THAT(message_of([&] {
                  renderer->render(town.scene.batch(), {sound, &count}, images.batch());
                  renderer->check();
                }),
                testing::ContainsRegex(count < 0 ? "number of views.*-1" : "number of views.*6"));
  }
}

/// Expects that the visibility of later views is NaN.
inline void expect_counted_queries(const MakeForRig& make) {
  Snapshot town = make_synthetic_town(1, 20);
  town.views.resize(2);
  const auto renderer = make(paper_rig(24, 14));
  renderer->upload(0, town.geometry);
  std::vector<VisibilityQuery> queries;
  for (int32_t agent = 0; agent < 20; ++agent) queries.insert(queries.end(), {{0, agent}, {1, agent}});
  std::vector<float> all(queries.size()), counted(queries.size());
  const int32_t count = 1;
  renderer->visibility(town.scene.batch(), town.views, queries, all);
  renderer->visibility(town.scene.batch(), {town.views, &count}, queries, counted);
  renderer->check();
  int in_frame = 0, in_frame_of_second = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].view == 1) {
      in_frame_of_second += std::isnan(all[i]) ? 0 : 1;
      EXPECT_TRUE(std::isnan(counted[i])) << i;
    } else if (std::isnan(all[i])) {
      EXPECT_TRUE(std::isnan(counted[i])) << i;
    } else {
      ++in_frame;
      EXPECT_EQ(counted[i], all[i]) << i;
    }
  }
  EXPECT_GT(in_frame, 0);
  EXPECT_GT(in_frame_of_second, 0);
}

}  // namespace pictura::test
