// Kernels of network_passes.h, emulated on the host, compared with loops in double precision.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

// Include this last, because it redefines CUDA's keywords.
#include "pictura/tests/backend_cuda/emulated_device.h"
// The emulation comes before the kernels that use it.
#include "pictura/tests/backend_cuda/learner/emulated_tensor_core.h"
// The kernels:
#include "pictura/backend_cuda/learner/image_patches.cuh"
#include "pictura/backend_cuda/learner/row_norms.cuh"

namespace pictura {

namespace cuda::image_patches {
// Shared memory of the running block.
alignas(16) unsigned char tile_memory[sizeof(Tile<6>)];
}  // namespace cuda::image_patches

namespace {

using Numbers = std::vector<float>;
using Doubles = std::vector<double>;

Numbers draw(size_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal(.3f, 1);
  Numbers numbers(count);
  for (float& x : numbers) x = normal(random);
  return numbers;
}

void launch(int64_t threads, const std::function<void()>& kernel) {
  emulation::launch(cuda::kThreads, static_cast<unsigned>((threads - 1) / cuda::kThreads + 1), /*seed=*/1,
                    cuda::image_patches::tile_memory, kernel);
}

void expect_near(const Numbers& got, const Doubles& expected, const char* what) {
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) {
    ASSERT_NEAR(got[i], expected[i], 2e-5 * (1 + std::abs(expected[i]))) << what << " " << i;
  }
}
// Adds the partial sums [sums, ...].
Doubles added(const Numbers& partial, size_t count) {
  Doubles sums(count);
  for (size_t i = 0; i < partial.size(); ++i) sums[i % count] += partial[i];
  return sums;
}
void expect_sums(const Numbers& partial, const Doubles& expected, const char* what) {
  const Doubles sums = added(partial, expected.size());
  expect_near(Numbers(sums.begin(), sums.end()), expected, what);
}

// A row of the layer norm in double precision.
struct Normalized {
  Doubles values;
  double inverse_deviation = 0;

  explicit Normalized(Doubles row) : values(std::move(row)) {
    const auto count = static_cast<double>(values.size());
    double mean = 0, variance = 0;
    for (const double v : values) mean += v / count;
    for (const double v : values) variance += (v - mean) * (v - mean) / count;
    inverse_deviation = 1 / std::sqrt(variance + kNormEpsilon);
    for (double& v : values) v = (v - mean) * inverse_deviation;
  }
  Doubles backward(const Doubles& grad) const {
    const auto count = static_cast<double>(values.size());
    double mean = 0, product_mean = 0;
    for (size_t c = 0; c < values.size(); ++c) {
      mean += grad[c] / count;
      product_mean += grad[c] * values[c] / count;
    }
    Doubles result(values.size());
    for (size_t c = 0; c < values.size(); ++c) {
      result[c] = (grad[c] - mean - values[c] * product_mean) * inverse_deviation;
    }
    return result;
  }
};

double gelu(double x) { return .5 * x * (1 + std::erf(x / std::numbers::sqrt2)); }
double gelu_derivative(double x) {
  return .5 * (1 + std::erf(x / std::numbers::sqrt2)) + x * std::exp(-.5 * x * x) / std::sqrt(2 * std::numbers::pi);
}

// Numbers of rows that do not fill the last warp.
template <int kChannels>
class Rows {
 public:
  static constexpr size_t kRows = 45, kPeriod = 5, kCount = kRows * kChannels;

  void expect_bias_norm_gelu() const {
    constexpr int64_t kSums = 3;
    Numbers out(kCount), grad_x(kCount), sums(kSums * kChannels);
    launch(kRows * cuda::row_norms::RowPart<kChannels>::kLanes,
           [&] { cuda::row_norms::bias_norm_gelu<float, kChannels>(kRows, x_.data(), bias_.data(), out.data()); });
    launch(kSums * cuda::kWarp, [&] {
      cuda::row_norms::bias_norm_gelu_backward<float, kChannels>(kRows, kSums, x_.data(), bias_.data(), grad_.data(),
                                                                 grad_x.data(), sums.data());
    });
    Doubles expected, to_x, to_bias(kChannels);
    for (size_t row = 0; row < kRows; ++row) {
      const Normalized normalized(sum_of_rows(x_, row, bias_, 0));
      Doubles grad;
      for (size_t c = 0; c < kChannels; ++c) {
        expected.push_back(gelu(normalized.values[c]));
        grad.push_back(grad_[row * kChannels + c] * gelu_derivative(normalized.values[c]));
      }
      append(normalized.backward(grad), &to_x, &to_bias, 0);
    }
    expect_near(out, expected, "out");
    expect_near(grad_x, to_x, "gradient");
    expect_sums(sums, to_bias, "gradient of the bias");
  }

  void expect_norm(bool has_position) const {
    constexpr int64_t kSums = 2;
    const int64_t period = has_position ? kPeriod : 1;
    const float* const position = has_position ? position_.data() : nullptr;
    Numbers out(kCount), grad_x(kCount), sums(static_cast<size_t>(kSums * period * 3 * kChannels));
    launch(kRows * cuda::row_norms::RowPart<kChannels>::kLanes, [&] {
      cuda::row_norms::norm<float, kChannels>(kRows, x_.data(), position, period, weight_.data(), bias_.data(),
                                              out.data());
    });
    launch(kSums * period * cuda::kWarp, [&] {
      cuda::row_norms::norm_backward<float, kChannels>(kRows, x_.data(), position, period, kSums, weight_.data(),
                                                       grad_.data(), grad_x.data(), sums.data());
    });
    Doubles expected, to_x, to_parameters(static_cast<size_t>(period) * 3 * kChannels);
    for (size_t row = 0; row < kRows; ++row) {
      const size_t of_position = row % static_cast<size_t>(period);
      const Normalized normalized(has_position ? sum_of_rows(x_, row, position_, of_position)
                                               : sum_of_rows(x_, row, Numbers(kChannels), 0));
      Doubles grad, to_weight, to_bias;
      for (size_t c = 0; c < kChannels; ++c) {
        const double g = grad_[row * kChannels + c];
        expected.push_back(normalized.values[c] * weight_[c] + bias_[c]);
        grad.push_back(g * weight_[c]);
        to_weight.push_back(g * normalized.values[c]);
        to_bias.push_back(g);
      }
      append(normalized.backward(grad), &to_x, &to_parameters, of_position * 3);
      Doubles unused;
      append(to_weight, &unused, &to_parameters, of_position * 3 + 1);
      append(to_bias, &unused, &to_parameters, of_position * 3 + 2);
    }
    expect_near(out, expected, "out");
    expect_near(grad_x, to_x, "gradient");
    expect_sums(sums, to_parameters, "gradients of position, weight and bias");
  }

 private:
  static Doubles sum_of_rows(const Numbers& a, size_t row_a, const Numbers& b, size_t row_b) {
    Doubles sum;
    for (size_t c = 0; c < kChannels; ++c) sum.push_back(double{a[row_a * kChannels + c]} + b[row_b * kChannels + c]);
    return sum;
  }
  static void append(const Doubles& row, Doubles* rows_inout, Doubles* sums_inout, size_t row_of_sum) {
    rows_inout->insert(rows_inout->end(), row.begin(), row.end());
    for (size_t c = 0; c < kChannels; ++c) (*sums_inout)[row_of_sum * kChannels + c] += row[c];
  }

  Numbers x_ = draw(kCount, 1), grad_ = draw(kCount, 2), position_ = draw(kPeriod * kChannels, 3),
          weight_ = draw(kChannels, 4), bias_ = draw(kChannels, 5);
};

template <int kChannels>
void expect_all() {
  SCOPED_TRACE(kChannels);
  const Rows<kChannels> rows;
  rows.expect_bias_norm_gelu();
  rows.expect_norm(/*has_position=*/false);
  rows.expect_norm(/*has_position=*/true);
}

TEST(EmulatedNorms, MatchDoublePrecision) {
  expect_all<64>();   // 8 lanes a row
  expect_all<192>();  // 8 lanes, 3 vectors each
  expect_all<512>();  // a warp, 2 vectors for each lane
}

// Patches of two cameras, with and without rows of whole words, and wider than a tile.
template <int kPatch>
void expect_patches(int64_t width_px) {
  SCOPED_TRACE(width_px);
  const PatchSize size{.views = 1, .cameras = 2, .height_px = 2 * kPatch + 1, .width_px = width_px, .patch_px = kPatch};
  constexpr int64_t kChannels = PatchSize::channels_of(kPatch);
  std::vector<uint8_t> images(static_cast<size_t>(size.views * size.cameras * 3 * size.height_px * width_px));
  std::mt19937_64 random(1);
  for (uint8_t& pixel : images) pixel = static_cast<uint8_t>(random());
  Numbers out(static_cast<size_t>(size.cameras * size.views * size.rows() * size.columns() * kChannels), -1);
  const auto tiles = static_cast<unsigned>((size.columns() - 1) / cuda::image_patches::kTile + 1);
  emulation::launch_grid(cuda::kThreads,
                         {static_cast<unsigned>(size.cameras * size.views), static_cast<unsigned>(size.rows()), tiles},
                         /*seed=*/1, cuda::image_patches::tile_memory,
                         [&] { cuda::image_patches::patches<float, kPatch>(size, images.data(), out.data()); });
  size_t i = 0;
  for (int64_t camera = 0; camera < size.cameras; ++camera) {
    for (int64_t view = 0; view < size.views; ++view) {
      for (int64_t patch = 0; patch < size.rows() * size.columns(); ++patch) {
        for (int64_t channel = 0; channel < kChannels; ++channel, ++i) {
          const int64_t color = channel / (kPatch * kPatch),
                        y = patch / size.columns() * kPatch + channel / kPatch % kPatch,
                        x = patch % size.columns() * kPatch + channel % kPatch;
          const bool is_pixel = color < 3 && y < size.height_px && x < width_px;
          const int64_t at = (((view * size.cameras + camera) * 3 + color) * size.height_px + y) * width_px + x;
          ASSERT_EQ(out[i], is_pixel ? images[static_cast<size_t>(at)] : 0) << "patch " << patch << ", " << channel;
        }
      }
    }
  }
}

TEST(EmulatedPatches, HoldEachPixel) {
  expect_patches<1>(50);
  expect_patches<3>(50);
  expect_patches<4>(132);
  for (const int64_t width_px : {50, 196}) expect_patches<6>(width_px);
}

}  // namespace
}  // namespace pictura
