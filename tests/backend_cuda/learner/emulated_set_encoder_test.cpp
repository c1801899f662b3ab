// The kernels that encode sets, emulated on the host, compared with loops in double precision.
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
#include "pictura/backend_cuda/learner/set_encoder.cuh"

namespace pictura {

namespace cuda::set_encoder {
// Shared memory of the running block.
alignas(16) unsigned char set_memory[sizeof(BackwardMemory<128>)];
static_assert(sizeof(ForwardMemory<128>) <= sizeof(BackwardMemory<128>));
}  // namespace cuda::set_encoder

namespace {

using Numbers = std::vector<float>;

double rounded(double x) { return cuda::to_float(cuda::to_half(static_cast<float>(x))); }

Numbers draw(size_t count, double deviation, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, deviation);
  Numbers numbers(count);
  for (float& x : numbers) x = static_cast<float>(normal(random));
  return numbers;
}

// Sets with their parameters. Numbers are drawn.
template <int kChannels>
struct Sets {
  static constexpr int64_t kSets = 21, kMaxMembers = 40, kColumns = 7;
  SetSize size;
  int64_t width;
  Numbers members, hidden_weight, hidden_bias, weight, bias;
  std::vector<int32_t> counts;

  explicit Sets(bool has_norm) {
    const RowFeatures features{.points = 1, .position_unit_m = 100.0f};
    size = {{kSets * kMaxMembers, kColumns, features, /*keeps_rows=*/true}, kMaxMembers, 1, has_norm, kChannels};
    width = size.members.width();
    members = draw(kSets * kMaxMembers * kColumns, 1, 1);
    hidden_weight = draw(static_cast<size_t>(kChannels * width), .5, 2);
    hidden_bias = draw(kChannels, .5, 3);
    weight = draw(kChannels * kChannels, 1 / std::sqrt(kChannels), 4);
    bias = draw(kChannels, 1, 5);
    for (int64_t set = 0; set < kSets; ++set) counts.push_back(static_cast<int32_t>(set * 2));  // from empty to full
  }
  SetParameters<const float> parameters() const {
    return {hidden_weight.data(), hidden_bias.data(), weight.data(), bias.data()};
  }

  double input(int64_t member, int64_t i) const {
    const float* const row = &members[static_cast<size_t>(member * kColumns)];
    return rounded(i < kColumns ? row[i] : row_feature(size.members.features, row, static_cast<int>(i - kColumns)));
  }
  // Inputs of the activations, and 1 / the standard deviation before the norm.
  std::vector<double> hidden(int64_t member, double* inverse_deviation_out) const {
    std::vector<double> values(kChannels);
    double mean = 0, variance = 0;
    for (size_t c = 0; c < kChannels; ++c) {
      values[c] = hidden_bias[c];
      for (int64_t i = 0; i < width; ++i) {
        values[c] += rounded(hidden_weight[c * static_cast<size_t>(width) + static_cast<size_t>(i)]) * input(member, i);
      }
      mean += values[c] / kChannels;
    }
    if (!size.has_norm) return values;
    for (const double v : values) variance += (v - mean) * (v - mean) / kChannels;
    *inverse_deviation_out = 1 / std::sqrt(variance + kNormEpsilon);
    for (double& v : values) v = (v - mean) * *inverse_deviation_out;
    return values;
  }
};

double gelu(double x) { return .5 * x * (1 + std::erf(x / std::numbers::sqrt2)); }
double gelu_derivative(double x) {
  return .5 * (1 + std::erf(x / std::numbers::sqrt2)) + x * std::exp(-.5 * x * x) / std::sqrt(2 * std::numbers::pi);
}

void launch(int threads, unsigned blocks, const std::function<void()>& kernel) {
  emulation::launch(threads, blocks, /*seed=*/1, cuda::set_encoder::set_memory, kernel);
}

double largest_of(const std::vector<double>& numbers) {
  double largest = 0;
  for (const double x : numbers) largest = std::max(largest, std::abs(x));
  return largest;
}

// Compares the sums over blocks, [blocks, ...], with the expected gradient.
void expect_sums(const Numbers& of_blocks, const std::vector<double>& expected, const char* what) {
  std::vector<double> sums(expected.size());
  for (size_t i = 0; i < of_blocks.size(); ++i) sums[i % sums.size()] += of_blocks[i];
  const double tolerance = 0.01 * largest_of(expected);
  for (size_t i = 0; i < sums.size(); ++i) ASSERT_NEAR(sums[i], expected[i], tolerance) << what << " " << i;
}

template <int kChannels>
void expect_as_in_double(bool has_norm) {
  constexpr unsigned kBlocks = 2;
  constexpr size_t kOutputs = Sets<kChannels>::kSets * kChannels;
  const Sets<kChannels> sets(has_norm);
  std::vector<cuda::Half> out(kOutputs), grads(kOutputs);
  std::vector<uint8_t> which(kOutputs);
  launch(cuda::set_encoder::ForwardMemory<kChannels>::kThreads, kBlocks, [&] {
    cuda::set_encoder::largest_embedding<kChannels>(sets.size, sets.members.data(), sets.counts.data(),
                                                    sets.parameters(), out.data(), which.data());
  });
  const Numbers drawn_grads = draw(kOutputs, 1, 6);
  for (size_t i = 0; i < kOutputs; ++i) grads[i] = cuda::to_half(drawn_grads[i]);
  const auto width = static_cast<size_t>(sets.width);
  Numbers hidden_weight(kBlocks * kChannels * width), hidden_bias(kBlocks * kChannels),
      weight(kBlocks * kChannels * kChannels), bias(kBlocks * kChannels);
  launch(cuda::set_encoder::BackwardMemory<kChannels>::kThreads, kBlocks, [&] {
    cuda::set_encoder::largest_embedding_backward<kChannels>(
        sets.size, sets.members.data(), sets.parameters(), which.data(), grads.data(),
        {hidden_weight.data(), hidden_bias.data(), weight.data(), bias.data()});
  });

  std::vector<double> to_hidden_weight(kChannels * width), to_hidden_bias(kChannels), to_weight(kChannels * kChannels),
      to_bias(kChannels);
  for (size_t set = 0; set < Sets<kChannels>::kSets; ++set) {
    const auto count = static_cast<size_t>(sets.counts[set]);
    if (count == 0) {
      for (size_t c = 0; c < kChannels; ++c) {
        ASSERT_EQ(cuda::to_float(out[set * kChannels + c]), 0);
        ASSERT_EQ(which[set * kChannels + c], SetSize::kNoMember);
      }
      continue;
    }
    std::vector<double> largest(kChannels, -INFINITY);
    std::vector<std::vector<double>> before(count), embeddings(count);
    std::vector<double> inverse_deviation(count);
    for (size_t m = 0; m < count; ++m) {
      before[m] = sets.hidden(static_cast<int64_t>(set * Sets<kChannels>::kMaxMembers + m), &inverse_deviation[m]);
      for (size_t c = 0; c < kChannels; ++c) {
        double sum = sets.bias[c];
        for (size_t i = 0; i < kChannels; ++i) {
          sum += rounded(sets.weight[c * kChannels + i]) * rounded(gelu(before[m][i]));
        }
        embeddings[m].push_back(sum);
        largest[c] = std::max(largest[c], sum);
      }
    }
    std::vector<std::vector<double>> to_embeddings(count, std::vector<double>(kChannels));
    for (size_t c = 0; c < kChannels; ++c) {
      const size_t at = set * kChannels + c;
      ASSERT_NEAR(cuda::to_float(out[at]), largest[c], .02) << "set " << set << ", channel " << c;
      ASSERT_LT(which[at], count);
      ASSERT_NEAR(embeddings[which[at]][c], largest[c], .01);
      const double grad = cuda::to_float(grads[at]);
      to_embeddings[which[at]][c] = grad;
      to_bias[c] += grad;
    }
    for (size_t m = 0; m < count; ++m) {
      std::vector<double> to_hidden(kChannels);
      double mean = 0, product_mean = 0;
      for (size_t i = 0; i < kChannels; ++i) {
        for (size_t c = 0; c < kChannels; ++c) {
          to_weight[c * kChannels + i] += to_embeddings[m][c] * gelu(before[m][i]);
          to_hidden[i] += to_embeddings[m][c] * sets.weight[c * kChannels + i];
        }
        to_hidden[i] *= gelu_derivative(before[m][i]);
        mean += to_hidden[i] / kChannels;
        product_mean += to_hidden[i] * before[m][i] / kChannels;
      }
      for (size_t i = 0; i < kChannels; ++i) {
        if (has_norm) to_hidden[i] = (to_hidden[i] - mean - before[m][i] * product_mean) * inverse_deviation[m];
        to_hidden_bias[i] += to_hidden[i];
        for (size_t k = 0; k < width; ++k) {
          to_hidden_weight[i * width + k] +=
              to_hidden[i] *
              sets.input(static_cast<int64_t>(set * Sets<kChannels>::kMaxMembers + m), static_cast<int64_t>(k));
        }
      }
    }
  }
  expect_sums(bias, to_bias, "bias");
  expect_sums(weight, to_weight, "weight");
  expect_sums(hidden_bias, to_hidden_bias, "hidden bias");
  expect_sums(hidden_weight, to_hidden_weight, "hidden weight");
}

TEST(EmulatedSetEncoder, EncodesAsInDoublePrecision) {
  for (const bool has_norm : {false, true}) {
    SCOPED_TRACE(has_norm);
    expect_as_in_double<64>(has_norm);
    expect_as_in_double<128>(has_norm);
  }
}

}  // namespace
}  // namespace pictura
