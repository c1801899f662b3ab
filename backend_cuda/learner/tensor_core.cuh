// Numbers in bf16 and their products on tensor cores.
#pragma once

#include <cstdint>

#include <cuda_bf16.h>

namespace pictura::cuda {

using Half = __nv_bfloat16;

__device__ inline Half to_half(float x) { return __float2bfloat16(x); }
__device__ inline float to_float(Half x) { return __bfloat162float(x); }
/// Rounds two numbers; the first is in the lower half.
__device__ inline uint32_t pack(float low, float high) {
  const __nv_bfloat162 pair = __floats2bfloat162_rn(low, high);
  return *reinterpret_cast<const uint32_t*>(&pair);
}

/// Computes sums += left * right for 16 rows of 16 numbers and 16 rows of 8, which the lanes of a warp hold as the
/// instruction mma.m16n8k16 defines: `low` and `high` are rows 2 (lane % 4) and the next of the right operand in column
/// lane / 4, and the rows 8 below.
__device__ inline void multiply_add(const uint32_t (&left)[4], uint32_t low, uint32_t high, float (&sums)[4]) {
  asm volatile(
      "mma.sync.aligned.m16n8k16.row.col.f32.bf16.bf16.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, {%0, %1, %2, "
      "%3};"
      : "+f"(sums[0]), "+f"(sums[1]), "+f"(sums[2]), "+f"(sums[3])
      : "r"(left[0]), "r"(left[1]), "r"(left[2]), "r"(left[3]), "r"(low), "r"(high));
}

/// Loads four blocks of 8 x 8 numbers from shared memory, transposed: a lane provides the address of a row of block
/// lane / 8, and gets two numbers of each block.
__device__ inline void load_transposed(const Half* row, uint32_t (&blocks_out)[4]) {
  const auto address = static_cast<uint32_t>(__cvta_generic_to_shared(row));
  asm volatile("ldmatrix.sync.aligned.m8n8.x4.trans.shared.b16 {%0, %1, %2, %3}, [%4];"
               : "=r"(blocks_out[0]), "=r"(blocks_out[1]), "=r"(blocks_out[2]), "=r"(blocks_out[3])
               : "r"(address));
}

}  // namespace pictura::cuda
