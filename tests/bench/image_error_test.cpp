// Differences that the comparison with the oracle detects, and differences within tolerance.
#include "pictura/bench/image_error.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "pictura/bench/truth/image_scenes.h"

namespace pictura {
namespace {

const Rig kRig = front_rig(8, 8);

// Returns the error of two black images whose first values differ.
template <typename Value>
ImageError error_with(PixelFormat format, Value first_value) {
  HostImages actual(kRig, 1, format);
  HostImages expected(kRig, 1, format);
  std::memcpy(actual.bytes().data(), &first_value, sizeof first_value);
  return compare_image(actual.camera(0), expected.camera(0), format, 0);
}

TEST(ImageError, NonFiniteValuesHaveInfiniteError) {
  const float infinite = std::numeric_limits<float>::infinity();
  for (const ImageError& error : {error_with(PixelFormat::f32, std::nanf("")), error_with(PixelFormat::f32, infinite),
                                  error_with(PixelFormat::f16, uint16_t{0x7E00}),     // NaN
                                  error_with(PixelFormat::f16, uint16_t{0xFC00})}) {  // -infinite
    EXPECT_EQ(error.values, 3 * 8 * 8);
    EXPECT_EQ(error.differing, 1);
    EXPECT_EQ(error.beyond, 1);
    EXPECT_TRUE(std::isinf(error.worst)) << error.worst;
    EXPECT_FALSE(error.is_within_tolerance());
  }
}

TEST(ImageError, EachFormatIsReadInItsOwnUnits) {
  EXPECT_DOUBLE_EQ(error_with(PixelFormat::u8, uint8_t{255}).worst, 1);
  EXPECT_DOUBLE_EQ(error_with(PixelFormat::f32, 0.25f).worst, 0.25);
  EXPECT_DOUBLE_EQ(error_with(PixelFormat::f16, uint16_t{0x3800}).worst, 0.5);
  EXPECT_DOUBLE_EQ(error_with(PixelFormat::f16, uint16_t{0xB800}).worst, 0.5);      // -0.5
  EXPECT_DOUBLE_EQ(error_with(PixelFormat::f16, uint16_t{0x0001}).worst, 0x1p-24);  // subnormal
  EXPECT_EQ(error_with(PixelFormat::f16, uint16_t{0x8000}).differing, 0);           // -0
}

TEST(ImageError, UnwrittenValuesOfPatchesAreDetectedBeyondTheImage) {
  HostImages actual(kRig, 2, PixelFormat::bf16, Planes::none, ChannelOrder::patches, 12),
      expected(kRig, 2, PixelFormat::bf16, Planes::none, ChannelOrder::patches, 12);
  fill_unwritten(actual.batch());
  const ImageError error =
      compare_image(actual.camera(0), expected.camera(0), PixelFormat::bf16, 1, ChannelOrder::patches, 12);
  EXPECT_EQ(error.values, 3 * 12 * 12);
  EXPECT_EQ(error.beyond, error.values);
}

TEST(ImageError, UnwrittenValuesAreDetectedInEveryFormatAndPlane) {
  for (const PixelFormat format : {PixelFormat::u8, PixelFormat::f16, PixelFormat::f32}) {
    HostImages actual(kRig, 2, format, Planes::all), expected(kRig, 2, format, Planes::all);
    fill_unwritten(actual.batch());
    for (int view = 0; view < 2; ++view) {
      const ImageError error = compare_image(actual.camera(0), expected.camera(0), format, view);
      EXPECT_EQ(error.beyond, error.values);
      EXPECT_EQ(error.plane_pixels, 8 * 8);
      EXPECT_EQ(error.differing_plane_pixels, error.plane_pixels);
    }
  }
}

TEST(ImageError, PlanesAreComparedBySurface) {
  const float infinite = std::numeric_limits<float>::infinity();
  HostImages actual(kRig, 2, PixelFormat::u8, Planes::all), expected(kRig, 2, PixelFormat::u8, Planes::all);
  const CameraImages &drawn = actual.camera(0), &wanted = expected.camera(0);
  auto differing = [&] { return compare_image(drawn, wanted, PixelFormat::u8, 1).differing_plane_pixels; };
  auto depths_differ = [&](float depth_m, float expected_m) {
    drawn.depth_m[64] = depth_m;
    wanted.depth_m[64] = expected_m;
    return differing() == 1;
  };
  EXPECT_FALSE(depths_differ(infinite, infinite));
  EXPECT_FALSE(depths_differ(50.001f, 50.0f));
  EXPECT_TRUE(depths_differ(50.01f, 50.0f));
  EXPECT_TRUE(depths_differ(50.0f, infinite));
  EXPECT_TRUE(depths_differ(infinite, 50.0f));
  EXPECT_TRUE(depths_differ(std::nanf(""), 50.0f));
  EXPECT_FALSE(depths_differ(50.0f, 50.0f));
  drawn.class_id[65] = 1;
  EXPECT_EQ(differing(), 1);
  drawn.instance_id[66] = 300;
  EXPECT_EQ(differing(), 2);
  EXPECT_FALSE(compare_image(drawn, wanted, PixelFormat::u8, 1).is_within_tolerance());
  EXPECT_TRUE(compare_image(drawn, wanted, PixelFormat::u8, 0).is_within_tolerance());
}

}  // namespace
}  // namespace pictura
