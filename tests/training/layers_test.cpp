// Layers on the host: patches of images, what padding of channels means, and features of points.
#include "pictura/training/layers.h"

#include <gtest/gtest.h>

#include "pictura/training/point_features.h"

namespace pictura {
namespace {

TEST(ImagePatches, PutEachPixelIntoAChannelAndPadWithBlack) {
  const int64_t views = 2, cameras = 2;
  const at::Tensor images =
      at::arange(views * cameras * 3 * 5 * 6, at::kInt).remainder(251).to(at::kByte).reshape({views, cameras, 3, 5, 6});
  const at::Tensor patches = image_patches(images, 4, at::kFloat);
  ASSERT_EQ(patches.sizes().vec(), (std::vector<int64_t>{cameras * views, 48, 2, 2}));
  EXPECT_TRUE(patches.is_contiguous(at::MemoryFormat::ChannelsLast));
  for (int64_t n = 0; n < cameras * views; ++n) {
    for (int64_t c = 0; c < 3; ++c) {
      for (int64_t y = 0; y < 8; ++y) {
        for (int64_t x = 0; x < 8; ++x) {
          const float expected = y < 5 && x < 6 ? images[n % views][n / views][c][y][x].item<float>() : 0;
          EXPECT_EQ(patches[n][(c * 4 + y % 4) * 4 + x % 4][y / 4][x / 4].item<float>(), expected) << c << y << x;
        }
      }
    }
  }
  EXPECT_TRUE(image_patches(images, 1, at::kFloat).equal(images.transpose(0, 1).flatten(0, 1).to(at::kFloat)));
}

TEST(ImagePatches, AOneByOneConvolutionOfThemIsOneOfTheImageWithTheirStride) {
  const at::Tensor images = at::arange(3 * 6 * 8, at::kInt).remainder(13).to(at::kByte).reshape({1, 1, 3, 6, 8});
  const at::Tensor weight = at::arange(4 * 3 * 2 * 2, at::kDouble).sin().reshape({4, 3, 2, 2});
  const at::Tensor expected =
      at::conv2d(images.flatten(0, 1).to(at::kDouble), weight, at::Tensor(), at::IntArrayRef({2, 2}));
  const at::Tensor features = at::conv2d(image_patches(images, 2, at::kDouble), weight.reshape({4, 12, 1, 1}));
  EXPECT_TRUE(at::allclose(features, expected));
}

TEST(PointFeatures, AreNearCoordinatesAndTheBearingOfEachPoint) {
  // A row with two points, (3, -4) m and (0, 20) m, and a number that is none. 120 m are 1.
  const at::Tensor row = at::tensor({3.0 / 120, -4.0 / 120, 0.0, 20.0 / 120, 0.5}, at::kDouble).unsqueeze(0);
  const at::Tensor features = point_features(row, 2, at::kDouble);
  const std::vector<double> expected{3.0 / 7, -4.0 / 8,  3.0 / 23, -4.0 / 24, 3.0 / 6, -4.0 / 6,
                                     0.0,     20.0 / 24, 0.0,      20.0 / 40, 0.0,     20.0 / 21};
  ASSERT_EQ(features.sizes().vec(), (std::vector<int64_t>{1, 2 * kPointFeatures}));
  for (int64_t i = 0; i < features.numel(); ++i) {
    EXPECT_NEAR(features[0][i].item<double>(), expected[static_cast<size_t>(i)], 1e-6) << i;
  }
}

TEST(PointFeatures, TellAMetreApartNearAndStayWithinOneFar) {
  const at::Tensor features =
      point_features(at::tensor({0.0f, 1.0f / 120, 100.0f, -100.0f}).view({2, 2}), 1, at::kFloat);
  EXPECT_GT(features[0][1].item<float>(), 0.19f);
  EXPECT_LE(features.abs().max().item<float>(), 1.0f);
}

TEST(ConvolveGelu, ReadsNothingFromChannelsBeyondThoseOfItsWeight) {
  const at::Tensor x = at::arange(2 * 5 * 4 * 6, at::kDouble).cos().reshape({2, 5, 4, 6}),
                   weight = at::arange(8 * 3 * 3 * 3, at::kDouble).sin().reshape({8, 3, 3, 3}),
                   bias = at::arange(8, at::kDouble);
  EXPECT_TRUE(at::allclose(convolve_gelu(x, weight, bias, 2), convolve_gelu(x.narrow(1, 0, 3), weight, bias, 2)));
}

}  // namespace
}  // namespace pictura
