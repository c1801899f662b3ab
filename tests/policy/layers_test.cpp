// Layers on the host: patches of images, padded channels, and features of rows. Also the library's passes on the host
// in single precision, compared with ATen's layers in double precision.
#include "pictura/policy/layers.h"

#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gtest/gtest.h>

#include "pictura/policy/host_convolution.h"
#include "pictura/policy/policy.h"
#include "pictura/policy/row_features.h"
#include "pictura/simulator/rules/ego_frame.h"
#include "pictura/tests/policy/numbers.h"

namespace pictura {
namespace {

TEST(ImagePatches, PutEachPixelIntoAChannelAndPadWithBlack) {
  const int64_t views = 2, cameras = 2;
  const at::Tensor images =
      at::arange(views * cameras * 3 * 5 * 6, at::kInt).remainder(251).to(at::kByte).reshape({views, cameras, 3, 5, 6});
  for (const int64_t side : {4, 6}) {
    const at::Tensor patches = image_patches(images, side, at::kFloat);
    const int64_t rows = (5 + side - 1) / side, columns = (6 + side - 1) / side;
    ASSERT_EQ(patches.sizes().vec(), (std::vector<int64_t>{cameras * views, 3 * side * side, rows, columns}));
    EXPECT_TRUE(patches.is_contiguous(at::MemoryFormat::ChannelsLast));
    for (int64_t n = 0; n < cameras * views; ++n) {
      for (int64_t c = 0; c < 3; ++c) {
        for (int64_t y = 0; y < rows * side; ++y) {
          for (int64_t x = 0; x < columns * side; ++x) {
            const float expected = y < 5 && x < 6 ? images[n % views][n / views][c][y][x].item<float>() : 0;
            const int64_t channel = (c * side + y % side) * side + x % side;
            EXPECT_EQ(patches[n][channel][y / side][x / side].item<float>(), expected) << side << c << y << x;
          }
        }
      }
    }
  }
  EXPECT_TRUE(image_patches(images, 1, at::kFloat).equal(images.transpose(0, 1).flatten(0, 1).to(at::kFloat)));
}

TEST(ImagePatches, AOneByOneConvolutionEqualsAStridedConvolutionOfTheImage) {
  const at::Tensor images = at::arange(3 * 6 * 8, at::kInt).remainder(13).to(at::kByte).reshape({1, 1, 3, 6, 8});
  const at::Tensor weight = at::arange(4 * 3 * 2 * 2, at::kDouble).sin().reshape({4, 3, 2, 2});
  const at::Tensor expected =
      at::conv2d(images.flatten(0, 1).to(at::kDouble), weight, at::Tensor(), at::IntArrayRef({2, 2}));
  const at::Tensor features = at::conv2d(image_patches(images, 2, at::kDouble), weight.reshape({4, 12, 1, 1}));
  EXPECT_TRUE(at::allclose(features, expected));
}

constexpr float kUnit_m = kScalePosition_m;

TEST(RowFeatures, APointHasNearCoordinatesAndItsBearing) {
  // A row with two points, (3, -4) m and (0, 20) m, and a number that belongs to no point. 120 m are 1.
  const at::Tensor row = at::tensor({3.0 / 120, -4.0 / 120, 0.0, 20.0 / 120, 0.5}, at::kDouble).unsqueeze(0);
  const at::Tensor features = row_features(row, {.points = 2, .position_unit_m = kUnit_m}, at::kDouble);
  const std::vector<double> expected{3.0 / 7, -4.0 / 8,  3.0 / 23, -4.0 / 24, 3.0 / 6, -4.0 / 6,
                                     0.0,     20.0 / 24, 0.0,      20.0 / 40, 0.0,     20.0 / 21};
  ASSERT_EQ(features.sizes().vec(), (std::vector<int64_t>{1, 2 * RowFeatures::kOfPoint}));
  for (int64_t i = 0; i < features.numel(); ++i) {
    EXPECT_NEAR(features[0][i].item<double>(), expected[i], 1e-6) << i;
  }
}

TEST(RowFeatures, PointFeaturesResolveAMetreNearbyAndAreAtMostOne) {
  const at::Tensor features = row_features(at::tensor({0.0f, 1.0f / 120, 100.0f, -100.0f}).view({2, 2}),
                                           {.points = 1, .position_unit_m = kUnit_m}, at::kFloat);
  EXPECT_GT(features[0][1].item<float>(), 0.19f);
  EXPECT_LE(features.abs().max().item<float>(), 1.0f);
}

// The row of a segment: its middle in the ego frame, in metres, and its direction.
at::Tensor segment_row(double x_m, double y_m, double half_length_m, double heading_rad) {
  return at::tensor({x_m / 120, y_m / 120, 0.0, half_length_m / 5, std::cos(heading_rad), std::sin(heading_rad), 0.7},
                    at::kDouble);
}

TEST(RowFeatures, ASegmentHasOffsetAlongItAndDistanceToItsLineAtTwoScales) {
  const at::Tensor rows = at::stack({
      segment_row(6, 1.75, 5, 0),       // ahead, to the left: its line passes 1.75 m left of the ego
      segment_row(6, 1.75, 5, kPi),     // the same line in the other direction, which sees the ego on its left
      segment_row(0, 16, 5, kPi / 2),   // begins to the left and leads away from it
      segment_row(-3, 0, 2, -kPi / 6),  // behind, to the right
  });
  const double along_m[]{-6, 6, -16, 3 * std::sqrt(0.75)}, left_m[]{-1.75, 1.75, 0, 1.5};
  const at::Tensor features = row_features(rows, {.of_segment = true, .position_unit_m = kUnit_m}, at::kDouble);
  ASSERT_EQ(features.sizes().vec(), (std::vector<int64_t>{4, RowFeatures::kOfSegment}));
  for (int64_t i = 0; i < 4; ++i) {
    const double along = along_m[i], left = left_m[i];
    const double expected[]{along / (std::abs(along) + 4), left / (std::abs(left) + 4), along / (std::abs(along) + 20),
                            left / (std::abs(left) + 20)};
    for (int64_t k = 0; k < 4; ++k) EXPECT_NEAR(features[i][k].item<double>(), expected[k], 1e-6) << i << " " << k;
  }
}

TEST(RowFeatures, FollowTheRowAndEachOther) {
  const at::Tensor row = segment_row(6, 1.75, 5, 0.3).view({1, 1, 7});
  const RowFeatures points{.points = 1, .position_unit_m = kUnit_m},
      segment{.of_segment = true, .position_unit_m = kUnit_m},
      both{.points = 1, .of_segment = true, .position_unit_m = kUnit_m};
  EXPECT_EQ(both.count(), points.count() + segment.count());
  const at::Tensor parts[]{row, row_features(row, points, at::kDouble), row_features(row, segment, at::kDouble)};
  EXPECT_TRUE(with_row_features(row, both, at::kDouble).equal(at::cat(parts, 2)));
}

TEST(ConvolveGelu, ReadsNothingFromChannelsBeyondThoseOfItsWeight) {
  const at::Tensor x = at::arange(2 * 5 * 4 * 6, at::kDouble).cos().reshape({2, 5, 4, 6}),
                   weight = at::arange(8 * 3 * 3 * 3, at::kDouble).sin().reshape({8, 3, 3, 3}),
                   bias = at::arange(8, at::kDouble);
  EXPECT_TRUE(at::allclose(convolve_gelu(x, weight, bias, 2), convolve_gelu(x.narrow(1, 0, 3), weight, bias, 2)));
}

using Layer = std::function<at::Tensor(const std::vector<at::Tensor>& inputs)>;

// Numbers in single precision.
at::Tensor float_numbers(at::IntArrayRef shape, double phase) { return test::numbers(shape, phase, at::kFloat); }

// The value of a layer and the gradients of its inputs, all of this type.
std::vector<at::Tensor> results(const Layer& layer, const std::vector<at::Tensor>& inputs, at::ScalarType type) {
  std::vector<at::Tensor> its_inputs;
  for (const at::Tensor& input : inputs) its_inputs.push_back(input.detach().clone().to(type).requires_grad_());
  std::vector<at::Tensor> all{layer(its_inputs)};
  all[0].backward(float_numbers(all[0].sizes(), 0.3).to(type));
  for (const at::Tensor& input : its_inputs) all.push_back(input.grad());
  for (at::Tensor& result : all) result = result.detach().to(at::kDouble);
  return all;
}

// Compares single precision, with and without gradients and with one thread and three, to double precision.
void expect_as_in_double(const Layer& layer, const Layer& plain, const std::vector<at::Tensor>& inputs) {
  const std::vector<at::Tensor> expected = results(plain, inputs, at::kDouble);
  const int threads = at::get_num_threads();
  for (const int some : {1, 3}) {
    at::set_num_threads(some);
    const std::vector<at::Tensor> got = results(layer, inputs, at::kFloat);
    for (size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(got[i].sizes(), expected[i].sizes()) << i;
      const double scale = std::max(1.0, expected[i].abs().max().item<double>());
      EXPECT_LE((got[i] - expected[i]).abs().max().item<double>(), 1e-5 * scale) << i << ", threads " << some;
    }
    const at::NoGradGuard no_grad;
    std::vector<at::Tensor> floats;
    for (const at::Tensor& input : inputs) floats.push_back(input.to(at::kFloat));
    EXPECT_TRUE(layer(floats).to(at::kDouble).equal(got[0])) << "threads " << some;
    for (size_t i = 0; i < inputs.size(); ++i) EXPECT_TRUE(floats[i].equal(inputs[i].to(at::kFloat))) << i;
  }
  at::set_num_threads(threads);
}

TEST(HostLayers, LinearGeluMatchesAten) {
  for (const int64_t out : {5, 64}) {
    expect_as_in_double([](const auto& in) { return linear_gelu(in[0], in[1], in[2]); },
                        [](const auto& in) { return at::gelu(at::linear(in[0], in[1], in[2])); },
                        {3 * float_numbers({7, 300, 6}, 0), float_numbers({out, 6}, 1), float_numbers({out}, 2)});
  }
}

TEST(HostLayers, GeluHandlesLargeAndNonFiniteInputs) {
  const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const at::Tensor x = at::tensor({0.0f, 50.0f, -50.0f, 1e30f, infinity, nan, 1e-20f, -1e-20f}).unsqueeze(1);
  const at::Tensor got = linear_gelu(x, at::ones({1, 1}), at::zeros({1})).squeeze(1);
  const float* const y = got.const_data_ptr<float>();
  EXPECT_EQ(y[0], 0);
  EXPECT_EQ(y[1], 50);
  EXPECT_NEAR(y[2], 0, 1e-30);
  EXPECT_EQ(y[3], 1e30f);
  EXPECT_EQ(y[4], infinity);
  EXPECT_TRUE(std::isnan(y[5]));
  EXPECT_NEAR(y[6], 5e-21, 1e-26);
  EXPECT_NEAR(y[7], -5e-21, 1e-26);
}

TEST(HostLayers, ConvolveGeluMatchesAten) {
  struct Case {
    int64_t in, out, kernel, stride, height, width, images;
  };
  for (const Case& c : {Case{3, 8, 3, 2, 18, 32, 3}, Case{8, 16, 3, 2, 9, 16, 50}, Case{16, 32, 3, 2, 5, 8, 3},
                        Case{5, 17, 5, 1, 4, 3, 5}, Case{12, 24, 1, 1, 3, 5, 300}, Case{6, 16, 1, 2, 5, 5, 4}}) {
    const auto of = [&c](const auto& conv) {
      return [&c, conv](const std::vector<at::Tensor>& in) {
        return conv(in[0].to(at::MemoryFormat::ChannelsLast), in[1], in[2], c.stride);
      };
    };
    expect_as_in_double(of(convolve_gelu), of([](const auto& x, const auto& w, const auto& b, int64_t stride) {
                          return at::gelu(at::conv2d(x, w, b, {stride}, {w.size(2) / 2}));
                        }),
                        {float_numbers({c.images, c.in, c.height, c.width}, 0),
                         float_numbers({c.out, c.in, c.kernel, c.kernel}, 1), float_numbers({c.out}, 2)});
  }
}

TEST(HostLayers, ConvolveGeluOfImagesWithoutGradientsMatchesAten) {
  for (const int64_t out : {8, 16, 32}) {
    const at::Tensor images = float_numbers({9, 3, 9, 14}, 0).to(at::kFloat).contiguous(at::MemoryFormat::ChannelsLast);
    const auto plain = [&images](const auto& in) {
      return at::gelu(
          at::conv2d(images.to(in[0].scalar_type()), in[0], in[1], at::IntArrayRef({2, 2}), at::IntArrayRef({1, 1})));
    };
    expect_as_in_double([&images](const auto& in) { return convolve_gelu(images, in[0], in[1], 2); }, plain,
                        {float_numbers({out, 3, 3, 3}, 1), float_numbers({out}, 2)});
  }
}

TEST(HostLayers, DirectConvolutionsHaveTheSameBitsByVectorsOfAnyWidth) {
  if (!host::has_wide_vectors()) GTEST_SKIP() << "this processor has no wide vectors";
  const host::ConvolutionSize size{.height = 5, .width = 7, .channels = 24, .kernel = 3, .stride = 2};
  const int64_t images = 5;
  for (const int64_t outputs : {8, 16, 32}) {
    const auto results_of = [&](bool is_wide) {
      const at::Tensor x = test::numbers({images, size.height, size.width, size.channels}, 0).to(at::kFloat),
                       weight = test::numbers({size.taps(), outputs}, 1).to(at::kFloat),
                       grad = test::numbers({images, size.pixels(), outputs}, 2).to(at::kFloat);
      std::vector<at::Tensor> made{at::empty_like(grad), at::zeros_like(weight), at::empty_like(x)};
      host::DirectConvolution convolution(size, outputs, images, is_wide);
      convolution.read(x.const_data_ptr<float>(), images);
      convolution.compute(weight.const_data_ptr<float>(), made[0].mutable_data_ptr<float>());
      convolution.add_weight_gradient(grad.const_data_ptr<float>(), made[1].mutable_data_ptr<float>());
      convolution.compute_image_gradient(grad.const_data_ptr<float>(), weight.t().contiguous().const_data_ptr<float>(),
                                         made[2].mutable_data_ptr<float>());
      return made;
    };
    const std::vector<at::Tensor> wide = results_of(true), narrow = results_of(false);
    for (size_t i = 0; i < wide.size(); ++i) EXPECT_TRUE(wide[i].equal(narrow[i])) << outputs << ", " << i;
  }
}

TEST(HostLayers, LargestEmbeddingIsTheMaximumOverPresentMembers) {
  const int64_t sets = 40, max_members = 23;
  const at::Tensor members = float_numbers({sets, max_members, 7}, 0.1),
                   counts = at::arange(sets, at::kInt).remainder(max_members + 1);
  for (const RowFeatures& features : {RowFeatures{}, RowFeatures{.points = 1, .position_unit_m = kUnit_m},
                                      RowFeatures{.points = 2, .position_unit_m = kUnit_m},
                                      RowFeatures{.of_segment = true, .position_unit_m = kUnit_m},
                                      RowFeatures{.points = 1, .of_segment = true, .position_unit_m = kUnit_m}}) {
    const at::Tensor floats = members.to(at::kFloat);
    const at::Tensor hidden_weight = float_numbers({16, 7 + features.count()}, 1), weight = float_numbers({24, 16}, 3);
    ASSERT_TRUE(has_fused_set_encoder(floats, features, hidden_weight, weight));
    for (const bool has_norm : {false, true}) {
      const auto plain = [&](const std::vector<at::Tensor>& in) {
        const at::Tensor rows = features.count() > 0 ? with_row_features(members, features, at::kDouble) : members;
        const at::Tensor hidden = at::linear(rows, in[0], in[1]);
        return masked_max(at::linear(at::gelu(has_norm ? at::layer_norm(hidden, {16}) : hidden), in[2], in[3]), counts);
      };
      const auto layer = [&](const std::vector<at::Tensor>& in) {
        return largest_embedding(floats, counts, features, has_norm, in[0], in[1], in[2], in[3]);
      };
      expect_as_in_double(layer, plain, {hidden_weight, float_numbers({16}, 2), weight, float_numbers({24}, 4)});
    }
  }
}

TEST(HostLayers, LargestEmbeddingPropagatesNanOfMembers) {
  at::Tensor members = at::zeros({1, 3, 2});
  members[0][1][0] = std::numeric_limits<float>::quiet_NaN();
  const at::Tensor one = at::ones({1, 2});
  const auto largest = [&](int count) {
    return largest_embedding(members, at::full({1}, count, at::kInt), {}, /*has_norm=*/false, one, at::zeros({1}),
                             at::ones({1, 1}), at::zeros({1}))
        .item<float>();
  };
  EXPECT_TRUE(std::isnan(largest(3)));
  EXPECT_EQ(largest(1), 0);
}

}  // namespace
}  // namespace pictura
