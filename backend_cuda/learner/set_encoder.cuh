// Kernels that encode sets of members by an MLP to the largest embeddings of each set, and their backward pass, on
// tensor cores. Values per member stay in registers, whereas ATen would keep them in memory. Products are in bf16, sums
// in fp32 in a fixed order. The functions of tensor_core.cuh must be included before, so that a test can emulate them.
#pragma once

#include "pictura/backend_cuda/learner/activation.cuh"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::cuda::set_encoder {

constexpr int kTile = 16;  // number of members that a warp processes together
/// Inputs of the first layer: numbers of a member, zeros, and a 1, whose weights' gradient is that of the bias.
constexpr int kInputs = SetSize::kMaxWidth + 1;
/// Warps of a block: each adds the gradients of a tile of rows of both weights.
template <int kChannels>
constexpr int kWarps = kChannels / kTile;
// Strides of rows in shared memory. With these strides, rows that a warp reads together are in different banks.
constexpr int kInputStride = kInputs + 8;
template <int kChannels>
constexpr int kChannelStride = kChannels + 8;

extern __shared__ __align__(16) unsigned char set_memory[];

__device__ inline int num_threads() { return static_cast<int>(blockDim.x); }
__device__ inline int lane() { return static_cast<int>(threadIdx.x) % kWarp; }
__device__ inline int warp() { return static_cast<int>(threadIdx.x) / kWarp; }
// Place of a lane's numbers in the fragments of a product: rows fragment_row() and the row 8 below, columns
// fragment_column() and the next.
__device__ inline int fragment_row() { return lane() / 4; }
__device__ inline int fragment_column() { return lane() % 4 * 2; }

__device__ inline uint32_t pair_at(const Half* numbers) { return *reinterpret_cast<const uint32_t*>(numbers); }

/// 16 rows of 16 numbers: the left operand of a product.
struct LeftTile {
  uint32_t pairs[4];
};
/// 16 rows of kChannels sums, 8 columns at a time. Per 8 columns, a lane holds two columns of two rows.
template <int kChannels>
struct Sums {
  static constexpr int kColumnTiles = kChannels / 8;
  float values[kColumnTiles][4] = {};

  /// Calls f(row of the lane's two, column tile, column of the lane's two, value&) for each value.
  template <typename F>
  __device__ void each(F&& f) {
#pragma unroll
    for (int n = 0; n < kColumnTiles; ++n) {
#pragma unroll
      for (int i = 0; i < 4; ++i) f(i / 2, n, i % 2, values[n][i]);
    }
  }
};

/// Loads a left operand from shared memory: columns [column, column + 16) of 16 rows.
__device__ inline LeftTile left_tile(const Half* rows, int stride, int column) {
  const Half* const first = rows + fragment_row() * stride + column + fragment_column();
  return {{pair_at(first), pair_at(first + 8 * stride), pair_at(first + 8), pair_at(first + 8 * stride + 8)}};
}

/// Converts sums to a left operand: their columns [16 k, 16 k + 16).
template <int kChannels>
__device__ LeftTile left_tile(const Sums<kChannels>& sums, int k) {
  const auto &first = sums.values[2 * k], &second = sums.values[2 * k + 1];
  return {{pack(first[0], first[1]), pack(first[2], first[3]), pack(second[0], second[1]), pack(second[2], second[3])}};
}

/// Adds the product of a left operand and the transpose of 8 * kTiles rows in shared memory, columns [column, column +
/// 16).
template <int kTiles>
__device__ void multiply_add_rows(const LeftTile& left, const Half* rows, int stride, int column,
                                  float (&sums)[kTiles][4]) {
#pragma unroll
  for (int n = 0; n < kTiles; ++n) {
    const Half* const first = rows + (8 * n + fragment_row()) * stride + column + fragment_column();
    multiply_add(left.pairs, pair_at(first), pair_at(first + 8), sums[n]);
  }
}

/// Loads the transpose of 16 rows of shared memory as a left operand: their columns [column, column + 16).
__device__ inline LeftTile transposed_left_tile(const Half* rows, int stride, int column) {
  LeftTile left;
  load_transposed(rows + (lane() % 8 + lane() / 16 * 8) * stride + column + lane() / 8 % 2 * 8, left.pairs);
  return left;
}

/// Adds the product of a left operand and 16 rows of shared memory, over 8 * kTiles columns.
template <int kTiles>
__device__ void multiply_add_columns(const LeftTile& left, const Half* rows, int stride, float (&sums)[kTiles][4]) {
  static_assert(kTiles % 2 == 0);
#pragma unroll
  for (int n = 0; n < kTiles; n += 2) {
    uint32_t blocks[4];
    load_transposed(rows + lane() % 16 * stride + 8 * n + lane() / 16 * 8, blocks);
    multiply_add(left.pairs, blocks[0], blocks[1], sums[n]);
    multiply_add(left.pairs, blocks[2], blocks[3], sums[n + 1]);
  }
}

/// Sums over the four lanes that share a row of fragments.
__device__ inline float row_sum(float x) {
  x += __shfl_xor_sync(0xffffffffu, x, 1);
  return x + __shfl_xor_sync(0xffffffffu, x, 2);
}

/// Normalizes each row to mean 0 and variance 1; sets 1 / the standard deviations of the lane's two rows.
template <int kChannels>
__device__ void normalize(Sums<kChannels>* rows_inout, float (&inverse_deviations_out)[2]) {
  float means[2] = {}, variances[2] = {};
  rows_inout->each([&](int row, int, int, float& v) { means[row] += v; });
#pragma unroll
  for (int row = 0; row < 2; ++row) means[row] = row_sum(means[row]) / kChannels;
  rows_inout->each([&](int row, int, int, float& v) {
    v -= means[row];
    variances[row] += v * v;
  });
#pragma unroll
  for (int row = 0; row < 2; ++row) {
    inverse_deviations_out[row] = rsqrtf(row_sum(variances[row]) / kChannels + kNormEpsilon);
  }
  rows_inout->each([&](int row, int, int, float& v) { v *= inverse_deviations_out[row]; });
}

/// Computes the gradient of rows from the gradient of their normalize() result.
template <int kChannels>
__device__ void normalize_backward(const Sums<kChannels>& normalized, const float (&inverse_deviations)[2],
                                   Sums<kChannels>* grads_inout) {
  float means[2] = {}, product_means[2] = {};
  grads_inout->each([&](int row, int n, int column, float& g) {
    means[row] += g;
    product_means[row] += g * normalized.values[n][2 * row + column];
  });
#pragma unroll
  for (int row = 0; row < 2; ++row) {
    means[row] = row_sum(means[row]) / kChannels;
    product_means[row] = row_sum(product_means[row]) / kChannels;
  }
  grads_inout->each([&](int row, int n, int column, float& g) {
    g = (g - means[row] - normalized.values[n][2 * row + column] * product_means[row]) * inverse_deviations[row];
  });
}

/// Copies a matrix of parameters, [rows, columns] or transposed, into shared memory. Collective over all threads of the
/// block.
__device__ inline void load_weights(const float* weights, int rows, int columns, bool is_transposed, int stride,
                                    Half* out) {
  for (int i = static_cast<int>(threadIdx.x); i < rows * columns; i += num_threads()) {
    const int row = i / columns, column = i % columns;
    out[is_transposed ? column * stride + row : row * stride + column] = to_half(weights[i]);
  }
}

/// Inputs of a warp's members: numbers and features of each, zeros, and a 1.
struct Inputs {
  alignas(16) Half rows[kTile][kInputStride];

  __device__ void clear() {
    for (int i = lane(); i < kTile * kInputStride; i += kWarp) rows[i / kInputStride][i % kInputStride] = Half{};
  }
  /// Loads members number(0), ..., number(count - 1) of a set, and zeros in the rows below.
  template <typename Number>
  __device__ void load(const SetSize& size, const float* members, int count, const Number& number) {
    const RowSize& row_size = size.members;
    const int row = lane() / 2, columns = static_cast<int>(row_size.columns),
              width = static_cast<int>(row_size.width());
    const float* const its_row = row < count ? members + number(row) * columns : nullptr;
    for (int column = lane() % 2; column < width; column += 2) {
      float value = 0;
      if (its_row) {
        value = column < columns ? its_row[column] : row_feature(row_size.features, its_row, column - columns);
      }
      rows[row][column] = to_half(value);
    }
    if (lane() % 2 == 0) rows[row][kInputs - 1] = to_half(its_row ? 1.0f : 0.0f);
    __syncwarp();
  }
};

/// First layer, in shared memory.
template <int kChannels>
struct HiddenLayer {
  alignas(16) Half weight[kChannels][kInputStride];
  float bias[kChannels];

  __device__ void load(const SetSize& size, const SetParameters<const float>& parameters) {
    for (int i = static_cast<int>(threadIdx.x); i < kChannels * kInputStride; i += num_threads()) {
      weight[i / kInputStride][i % kInputStride] = Half{};
    }
    __syncthreads();
    load_weights(parameters.hidden_weight, kChannels, static_cast<int>(size.members.width()), /*is_transposed=*/false,
                 kInputStride, weight[0]);
    for (int i = static_cast<int>(threadIdx.x); i < kChannels; i += num_threads()) bias[i] = parameters.hidden_bias[i];
  }

  /// Computes the input of the activation, normalized if there is a norm.
  __device__ Sums<kChannels> apply(const Inputs& inputs, bool has_norm, float (&inverse_deviations_out)[2]) const {
    Sums<kChannels> sums;
#pragma unroll
    for (int k = 0; k < kInputs; k += 16) {
      multiply_add_rows(left_tile(inputs.rows[0], kInputStride, k), weight[0], kInputStride, k, sums.values);
    }
    sums.each([&](int, int n, int column, float& v) { v += bias[8 * n + fragment_column() + column]; });
    if (has_norm) normalize(&sums, inverse_deviations_out);
    return sums;
  }
};

/// Maximum so far in each of the columns of a lane, and its member; among equal values, the first member.
template <int kChannels>
struct Largest {
  static constexpr int kColumnTiles = kChannels / 8;
  float values[kColumnTiles][2];
  int members[kColumnTiles][2];

  __device__ Largest() {
#pragma unroll
    for (int i = 0; i < 2 * kColumnTiles; ++i) {
      values[i / 2][i % 2] = -INFINITY;
      members[i / 2][i % 2] = SetSize::kNoMember;
    }
  }
  __device__ void take(int n, int column, float value, int member) {
    float& largest = values[n][column];
    int& its_member = members[n][column];
    // NaN is taken and kept, so that a failing network is detected.
    const bool is_larger = value > largest || (value != value && largest == largest);
    if (is_larger || (value == largest && member < its_member) || its_member == SetSize::kNoMember) {
      largest = value;
      its_member = member;
    }
  }
  /// Reduces over the lanes that share a column.
  __device__ void reduce() {
#pragma unroll
    for (int i = 0; i < 2 * kColumnTiles; ++i) {
#pragma unroll
      for (int distance = 4; distance < kWarp; distance *= 2) {
        const float value = __shfl_xor_sync(0xffffffffu, values[i / 2][i % 2], distance);
        const int member = __shfl_xor_sync(0xffffffffu, members[i / 2][i % 2], distance);
        if (member != SetSize::kNoMember) take(i / 2, i % 2, value, member);
      }
    }
  }
};

/// Shared memory of largest_embedding().
template <int kChannels>
struct ForwardMemory {
  static constexpr int kThreads = kWarps<kChannels> * kWarp;
  HiddenLayer<kChannels> hidden;
  alignas(16) Half weight[kChannels][kChannelStride<kChannels>];
  float bias[kChannels];
  Inputs inputs[kWarps<kChannels>];
};

// A warp processes sets at a fixed stride.
template <int kChannels>
__global__ void __launch_bounds__(ForwardMemory<kChannels>::kThreads)
    largest_embedding(SetSize size, const float* members, const int32_t* counts, SetParameters<const float> parameters,
                      Half* out, uint8_t* which_out) {
  constexpr int kStride = kChannelStride<kChannels>, kColumnTiles = kChannels / 8;
  constexpr int kTogether = 8;  // column tiles of embeddings in registers
  auto& memory = *reinterpret_cast<ForwardMemory<kChannels>*>(set_memory);
  memory.hidden.load(size, parameters);
  load_weights(parameters.weight, kChannels, kChannels, /*is_transposed=*/false, kStride, memory.weight[0]);
  for (int i = static_cast<int>(threadIdx.x); i < kChannels; i += num_threads()) memory.bias[i] = parameters.bias[i];
  Inputs& inputs = memory.inputs[warp()];
  inputs.clear();
  __syncthreads();

  const int64_t stride = gridDim.x * int64_t{kWarps<kChannels>};
  for (int64_t set = blockIdx.x * int64_t{kWarps<kChannels>} + warp(); set < size.sets(); set += stride) {
    const int count = counts[set * size.counts_stride];
    const float* const its_members = members + set * size.max_members * size.members.columns;
    Largest<kChannels> largest;
    for (int first = 0; first < count; first += kTile) {
      inputs.load(size, its_members, count - first, [first](int row) { return first + row; });
      LeftTile activations[kChannels / 16];
      {
        float inverse_deviations[2];
        Sums<kChannels> sums = memory.hidden.apply(inputs, size.has_norm, inverse_deviations);
        sums.each([](int, int, int, float& v) { v = gelu(v); });
#pragma unroll
        for (int k = 0; k < kChannels / 16; ++k) activations[k] = left_tile(sums, k);
      }
#pragma unroll
      for (int begin = 0; begin < kColumnTiles; begin += kTogether) {
        float embeddings[kTogether][4] = {};
#pragma unroll
        for (int k = 0; k < kChannels / 16; ++k) {
          multiply_add_rows(activations[k], memory.weight[8 * begin], kStride, 16 * k, embeddings);
        }
#pragma unroll
        for (int n = 0; n < kTogether; ++n) {
#pragma unroll
          for (int i = 0; i < 4; ++i) {
            const int member = first + fragment_row() + i / 2 * 8;
            if (member < count) largest.take(begin + n, i % 2, embeddings[n][i], member);
          }
        }
      }
      __syncwarp();  // all lanes have read the inputs
    }
    largest.reduce();
#pragma unroll
    for (int n = 0; n < kColumnTiles; ++n) {
      if (fragment_row() > 0) continue;
      const int channel = 8 * n + fragment_column();
      const int64_t at = set * kChannels + channel;
      reinterpret_cast<uint32_t*>(out)[at / 2] =
          count > 0 ? pack(largest.values[n][0] + memory.bias[channel], largest.values[n][1] + memory.bias[channel + 1])
                    : 0;
      if (which_out) {
        which_out[at] = static_cast<uint8_t>(largest.members[n][0]);
        which_out[at + 1] = static_cast<uint8_t>(largest.members[n][1]);
      }
    }
  }
}

/// Members of a set that have the maximum of some channel, in ascending order: each has a place in this list.
template <int kChannels>
struct Chosen {
  static constexpr int kOfLane = kChannels / kWarp;  // channels of a lane
  uint8_t members[kChannels];

  /// Finds the chosen members from the members of the lane's channels. places_out: the places of the channels' members;
  /// -1 if a channel has no member. Returns the number of chosen members.
  __device__ int find(const uint8_t (&which)[kOfLane], int max_members, int (&places_out)[kOfLane]) {
    int count = 0;
#pragma unroll
    for (int i = 0; i < kOfLane; ++i) places_out[i] = -1;
    for (int first = 0; first < max_members; first += 32) {
      uint32_t bits = 0;
#pragma unroll
      for (int i = 0; i < kOfLane; ++i) {
        if (is_within(which[i], first)) bits |= 1u << (which[i] - first);
      }
      bits = __reduce_or_sync(0xffffffffu, bits);
      const auto place = [&](int bit) { return count + __popc(bits & ((1u << bit) - 1)); };
#pragma unroll
      for (int i = 0; i < kOfLane; ++i) {
        if (is_within(which[i], first)) places_out[i] = place(which[i] - first);
      }
      if (bits >> lane() & 1) members[place(lane())] = static_cast<uint8_t>(first + lane());
      count += __popc(bits);
    }
    __syncwarp();
    return count;
  }

 private:
  __device__ static bool is_within(uint8_t which, int first) {
    return which != SetSize::kNoMember && which >= first && which < first + 32;
  }
};

/// Data of a warp's chosen members for the sums over rows.
template <int kChannels>
struct BackwardTile {
  static constexpr int kStride = kChannelStride<kChannels>, kOfLane = Chosen<kChannels>::kOfLane;
  Inputs inputs;
  alignas(16) Half activations[kTile][kStride], grads[kTile][kStride], hidden_grads[kTile][kStride];
  Chosen<kChannels> chosen;

  /// Writes the gradients of the embeddings of members with places [first, first + kTile): each channel belongs to one
  /// member.
  __device__ void scatter(int first, const int (&places)[kOfLane], const Half (&its_grads)[kOfLane]) {
    for (int i = lane(); i < kTile * kStride / 2; i += kWarp) reinterpret_cast<uint32_t*>(grads[0])[i] = 0;
    __syncwarp();
#pragma unroll
    for (int i = 0; i < kOfLane; ++i) {
      const int row = places[i] - first;
      if (places[i] >= 0 && row >= 0 && row < kTile) grads[row][kOfLane * lane() + i] = its_grads[i];
    }
    __syncwarp();
  }
};

/// Stores f of each value in rows of shared memory.
template <int kChannels, typename F>
__device__ void store(const Sums<kChannels>& sums, const F& f, Half* rows) {
#pragma unroll
  for (int n = 0; n < Sums<kChannels>::kColumnTiles; ++n) {
#pragma unroll
    for (int row = 0; row < 2; ++row) {
      Half* const at = rows + (fragment_row() + 8 * row) * kChannelStride<kChannels> + 8 * n + fragment_column();
      *reinterpret_cast<uint32_t*>(at) = pack(f(sums.values[n][2 * row]), f(sums.values[n][2 * row + 1]));
    }
  }
}

/// Shared memory of largest_embedding_backward().
template <int kChannels>
struct BackwardMemory {
  static constexpr int kThreads = kWarps<kChannels> * kWarp;
  HiddenLayer<kChannels> hidden;
  alignas(16) Half weight[kChannels][kChannelStride<kChannels>];  // [hidden, out]
  BackwardTile<kChannels> tiles[kWarps<kChannels>];
  int num_tiles[kWarps<kChannels>];
};

// A warp processes a set: it computes the chosen members, one tile at a time. Then each warp of the block adds its tile
// of the rows of both weights' gradients, from the tiles of all warps.
template <int kChannels>
__global__ void __launch_bounds__(BackwardMemory<kChannels>::kThreads)
    largest_embedding_backward(SetSize size, const float* members, SetParameters<const float> parameters,
                               const uint8_t* which, const Half* grad_out, SetParameters<float> sums_out) {
  constexpr int kStride = kChannelStride<kChannels>, kColumnTiles = kChannels / 8, kOfLane = Chosen<kChannels>::kOfLane,
                kAllWarps = kWarps<kChannels>;
  auto& memory = *reinterpret_cast<BackwardMemory<kChannels>*>(set_memory);
  memory.hidden.load(size, parameters);
  load_weights(parameters.weight, kChannels, kChannels, /*is_transposed=*/true, kStride, memory.weight[0]);
  BackwardTile<kChannels>& tile = memory.tiles[warp()];
  tile.inputs.clear();

  float weight_sums[kColumnTiles][4] = {}, hidden_weight_sums[kInputs / 8][4] = {}, bias_sums[kOfLane] = {};
  for (int64_t first_set = blockIdx.x * int64_t{kAllWarps}; first_set < size.sets();
       first_set += gridDim.x * int64_t{kAllWarps}) {
    const int64_t set = first_set + warp();
    int count = 0, places[kOfLane] = {};
    Half its_grads[kOfLane] = {};
    if (set < size.sets()) {
      const int64_t at = set * kChannels + kOfLane * lane();
      uint8_t its_which[kOfLane];
#pragma unroll
      for (int i = 0; i < kOfLane; ++i) {
        its_which[i] = which[at + i];
        its_grads[i] = grad_out[at + i];
        if (its_which[i] != SetSize::kNoMember) bias_sums[i] += to_float(its_grads[i]);
      }
      count = tile.chosen.find(its_which, static_cast<int>(size.max_members), places);
    }
    if (lane() == 0) memory.num_tiles[warp()] = (count + kTile - 1) / kTile;
    __syncthreads();
    int most_tiles = 0;
#pragma unroll
    for (int i = 0; i < kAllWarps; ++i) most_tiles = max_of(most_tiles, memory.num_tiles[i]);

    for (int t = 0; t < most_tiles; ++t) {
      const int first = t * kTile;
      if (first < count) {
        tile.inputs.load(size, members + set * size.max_members * size.members.columns, count - first,
                         [&](int row) { return tile.chosen.members[first + row]; });
        tile.scatter(first, places, its_grads);
        float inverse_deviations[2];
        const Sums<kChannels> before = memory.hidden.apply(tile.inputs, size.has_norm, inverse_deviations);
        store(before, [](float v) { return gelu(v); }, tile.activations[0]);
        Sums<kChannels> grads;
#pragma unroll
        for (int k = 0; k < kChannels; k += 16) {
          multiply_add_rows(left_tile(tile.grads[0], kStride, k), memory.weight[0], kStride, k, grads.values);
        }
        grads.each(
            [&](int row, int n, int column, float& g) { g *= gelu_derivative(before.values[n][2 * row + column]); });
        if (size.has_norm) normalize_backward(before, inverse_deviations, &grads);
        store(grads, [](float g) { return g; }, tile.hidden_grads[0]);
      }
      __syncthreads();
#pragma unroll 1
      for (int i = 0; i < kAllWarps; ++i) {
        if (t >= memory.num_tiles[i]) continue;
        const BackwardTile<kChannels>& its = memory.tiles[i];
        multiply_add_columns(transposed_left_tile(its.grads[0], kStride, kTile * warp()), its.activations[0], kStride,
                             weight_sums);
        multiply_add_columns(transposed_left_tile(its.hidden_grads[0], kStride, kTile * warp()), its.inputs.rows[0],
                             kInputStride, hidden_weight_sums);
      }
      __syncthreads();
    }
    __syncthreads();  // all threads have read num_tiles
  }
  __syncthreads();  // in blocks without sets, warps have cleared their tiles

  const int width = static_cast<int>(size.members.width());
  const int64_t block = blockIdx.x;
#pragma unroll
  for (int i = 0; i < 4; ++i) {
    const int row = kTile * warp() + fragment_row() + i / 2 * 8;
#pragma unroll
    for (int n = 0; n < kColumnTiles; ++n) {
      const int column = 8 * n + fragment_column() + i % 2;
      sums_out.weight[(block * kChannels + row) * kChannels + column] = weight_sums[n][i];
      if (n >= kInputs / 8) continue;
      if (column < width) sums_out.hidden_weight[(block * kChannels + row) * width + column] = hidden_weight_sums[n][i];
      if (column == kInputs - 1) sums_out.hidden_bias[block * kChannels + row] = hidden_weight_sums[n][i];
    }
  }
  // Sums per warp, [warp, channel], in the memory of the tiles, which are no longer needed.
  float* const bias = reinterpret_cast<float*>(memory.tiles);
#pragma unroll
  for (int i = 0; i < kOfLane; ++i) bias[warp() * kChannels + kOfLane * lane() + i] = bias_sums[i];
  __syncthreads();
  for (int channel = static_cast<int>(threadIdx.x); channel < kChannels; channel += num_threads()) {
    float sum = 0;
    for (int i = 0; i < kAllWarps; ++i) sum += bias[i * kChannels + channel];
    sums_out.bias[block * kChannels + channel] = sum;
  }
}

}  // namespace pictura::cuda::set_encoder
