// Emulation of backend_cuda/learner/tensor_core.cuh on the host. emulated_device.h must be included before.
#pragma once

#include <array>
#include <cstdint>

#include "pictura/policy/safetensors.h"

namespace pictura::cuda {

struct Half {
  uint16_t bits = 0;
};
static_assert(sizeof(Half) == 2);

inline Half to_half(float x) { return {bf16_of(x)}; }
inline float to_float(Half x) { return std::bit_cast<float>(uint32_t{x.bits} << 16); }
inline uint32_t pack(float low, float high) { return uint32_t{to_half(low).bits} | uint32_t{to_half(high).bits} << 16; }
inline float number_of(uint64_t numbers, int i) {
  return to_float({static_cast<uint16_t>(numbers >> (16 * i) & 0xFFFF)});
}

/// Returns the values of all lanes of the warp.
inline std::array<uint64_t, 32> values_of_lanes(const char* what, uint64_t value) {
  const uint64_t* values = emulation::Block::current()->exchange(what, value);
  std::array<uint64_t, 32> result;
  std::copy(values, values + 32, result.begin());
  return result;
}

inline void multiply_add(const uint32_t (&left)[4], uint32_t low, uint32_t high, float (&sums)[4]) {
  const auto left_columns = values_of_lanes("left", left[0] | uint64_t{left[1]} << 32),
             right_columns = values_of_lanes("left + 8", left[2] | uint64_t{left[3]} << 32),
             right = values_of_lanes("right", low | uint64_t{high} << 32);
  const int lane = static_cast<int>(threadIdx.x) % 32;
  for (int i = 0; i < 4; ++i) {
    const int row = lane / 4 + i / 2 * 8, column = lane % 4 * 2 + i % 2;
    for (int k = 0; k < 16; ++k) {
      const auto& of_left = k < 8 ? left_columns : right_columns;
      const auto left_lane = static_cast<size_t>(row % 8 * 4 + k % 8 / 2);
      const auto right_lane = static_cast<size_t>(column * 4 + k % 8 / 2);
      sums[i] += number_of(of_left[left_lane], row / 8 * 2 + k % 2) * number_of(right[right_lane], k / 8 * 2 + k % 2);
    }
  }
}

inline void load_transposed(const Half* row, uint32_t (&blocks_out)[4]) {
  const auto rows = values_of_lanes("load transposed", reinterpret_cast<uint64_t>(row));
  const size_t lane = threadIdx.x % 32;
  for (size_t block = 0; block < 4; ++block) {
    const auto number = [&](size_t i) {
      return uint32_t{reinterpret_cast<const Half*>(rows[8 * block + 2 * (lane % 4) + i])[lane / 4].bits};
    };
    blocks_out[block] = number(0) | number(1) << 16;
  }
}

}  // namespace pictura::cuda
