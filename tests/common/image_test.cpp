// Places of images in memory, and host memory for images.
#include "pictura/common/image.h"

#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

Rig rig_of_two_sizes() {
  Rig rig = paper_rig(8, 4);
  rig.cameras[1] = paper_rig(5, 3).cameras[1];
  return rig;
}

TEST(ImageLayout, ABlockForEachSizeInTheOrderOfFirstAppearance) {
  const ImageLayout layout = image_layout(rig_of_two_sizes(), 3, PixelFormat::f16);
  ASSERT_EQ(layout.blocks.size(), 2u);
  EXPECT_EQ(layout.blocks[0].cameras, (std::vector<int>{0, 2, 3}));
  EXPECT_EQ(layout.blocks[1].cameras, (std::vector<int>{1}));
  EXPECT_EQ(layout.blocks[1].offset, 3 * 3 * 3 * 8 * 4);
  EXPECT_EQ(layout.num_values, 3 * 3 * (3 * 8 * 4 + 5 * 3));
  EXPECT_EQ(layout.bytes(), 2u * 3 * 3 * (3 * 8 * 4 + 5 * 3));
  const CameraLayout& third = layout.cameras[2];  // the second of its block
  EXPECT_EQ(third.size, (ImageSize{8, 4}));
  EXPECT_EQ(third.block, 0);
  EXPECT_EQ(third.offset, 3 * 8 * 4);
  EXPECT_EQ(third.view_stride, 3 * 3 * 8 * 4);
  EXPECT_EQ(third.camera_stride, 3 * 8 * 4);
  EXPECT_EQ(third.channel_stride, 8 * 4);
  EXPECT_EQ(third.row_stride, 8);
  EXPECT_EQ(third.pixel_stride, 1);
}

TEST(ImageLayout, InterleavedChannelsAreNextToEachOther) {
  const CameraLayout camera = image_layout(paper_rig(8, 4), 2, PixelFormat::u8, ChannelOrder::interleaved).cameras[3];
  EXPECT_EQ(camera.offset, 3 * 3 * 8 * 4);
  EXPECT_EQ(camera.channel_stride, 1);
  EXPECT_EQ(camera.pixel_stride, 3);
  EXPECT_EQ(camera.row_stride, 3 * 8);
}

// 54 rows in patches of 12 px make five rows of patches, like 18 rows in patches of 4 px.
TEST(ImageLayout, PatchesMatchHandComputedPixels) {
  static_assert(patches_along(12, 54) == 5 && patches_along(4, 18) == 5 && patches_along(12, 96) == 8);
  static_assert(patch_values(8) == 192 && patch_values(12) == 432 && patch_values(16) == 768);
  EXPECT_EQ(place_in_patches(4, 10, 2, 9, 5), (1 * 3 + 2) * 48 + (2 * 4 + 1) * 4 + 1);
  EXPECT_EQ(place_in_patches(8, 20, 1, 17, 10), (1 * 3 + 2) * 192 + (1 * 8 + 2) * 8 + 1);
  EXPECT_EQ(place_in_patches(12, 96, 2, 95, 53), (4 * 8 + 7) * 432 + (2 * 12 + 5) * 12 + 11);
  EXPECT_EQ(place_in_patches(16, 33, 0, 32, 15), 2 * 768 + 15 * 16);
  const ImageLayout layout = image_layout(paper_rig(96, 54), 2, PixelFormat::bf16, ChannelOrder::patches, 12);
  EXPECT_EQ(layout.patch_px, 12);
  EXPECT_EQ(layout.cameras[1].offset, 40 * 432);
  EXPECT_EQ(layout.num_values, 2 * 4 * 40 * 432);
}

TEST(ImageLayout, PatchesOfOtherSidesAreRefused) {
  for (const int patch_px : {0, 2, 6, 20, -4}) {
    EXPECT_THAT(
        test::message_of([&] { image_layout(paper_rig(), 1, PixelFormat::bf16, ChannelOrder::patches, patch_px); }),
        testing::HasSubstr(fmt::format("images: expected patches of 4, 8, 12 or 16 pixels squared, got {}", patch_px)));
  }
}

TEST(ImageLayout, EveryValueHasOnePlace) {
  for (const ChannelOrder order : {ChannelOrder::planar, ChannelOrder::interleaved}) {
    const ImageLayout layout = image_layout(rig_of_two_sizes(), 2, PixelFormat::u8, order);
    std::set<int64_t> places;
    for (const CameraLayout& camera : layout.cameras) {
      for (int view = 0; view < 2; ++view) {
        for (int channel = 0; channel < 3; ++channel) {
          for (int y = 0; y < camera.size.height_px; ++y) {
            for (int x = 0; x < camera.size.width_px; ++x) {
              places.insert(camera.offset + view * camera.view_stride + channel * camera.channel_stride +
                            y * camera.row_stride + x * camera.pixel_stride);
            }
          }
        }
      }
    }
    EXPECT_EQ(static_cast<int64_t>(places.size()), layout.num_values);
    EXPECT_EQ(*places.begin(), 0);
    EXPECT_EQ(*places.rbegin(), layout.num_values - 1);
  }
}

TEST(ImageLayout, WrongNumbersOfViewsAreRefused) {
  EXPECT_THAT(test::message_of([] { image_layout(paper_rig(), -1, PixelFormat::u8); }),
              testing::HasSubstr("expected 0 views or more, got -1"));
  EXPECT_THROW(image_layout(Rig{}, 1, PixelFormat::u8), Error);
}

TEST(HostImages, MixedSizesGetOneBlockEach) {
  Rig rig = paper_rig(8, 4);
  rig.cameras[2].width_px = 5;
  HostImages images(rig, 3);
  EXPECT_EQ(images.bytes().size(), 3u * 3 * (3 * 8 * 4 + 5 * 4));
  EXPECT_EQ(images.camera(0).view_stride, 3 * 3 * 8 * 4);
  EXPECT_EQ(images.camera(2).view_stride, 3 * 5 * 4);
  const auto* first = static_cast<const uint8_t*>(images.camera(0).data);
  EXPECT_EQ(static_cast<const uint8_t*>(images.camera(3).data) - first, 2 * 3 * 8 * 4)
      << "camera 3 is the third of its size";
}

TEST(HostImages, InterleavedHoldsThePixelsOfOneImage) {
  HostImages images(rig_of_two_sizes(), 2);
  const CameraImages& camera = images.camera(1);
  // View 1, channel 2, row 1, column 4.
  static_cast<uint8_t*>(camera.data)[camera.view_stride + (2 * 3 + 1) * 5 + 4] = 77;
  const std::vector<uint8_t> rgb = images.interleaved(1, 1);
  ASSERT_EQ(rgb.size(), 3u * 5 * 3);
  EXPECT_EQ(rgb[3 * (1 * 5 + 4) + 2], 77);
  EXPECT_EQ(std::count(rgb.begin(), rgb.end(), 0), static_cast<std::ptrdiff_t>(rgb.size()) - 1);
}

}  // namespace
}  // namespace pictura
