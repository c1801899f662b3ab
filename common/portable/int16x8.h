// SIMD on eight 16-bit integers.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

#if !defined(__CUDA_ARCH__)
// Vector types, because g++ 12 compiles arrays in inlined functions to scalar code. Unsigned arithmetic wraps around.
using Int16Vector = int16_t __attribute__((vector_size(16)));
using Uint16Vector = uint16_t __attribute__((vector_size(16)));
#endif

/// Eight 16-bit integers. On a device, word k holds elements k (lower half) and k + 4.
struct Int16x8 {
#if defined(__CUDA_ARCH__)
  uint32_t halves[4];
#else
  Int16Vector value;
#endif
};
constexpr int kInt16x8Size = 8, kInt16x8Half = 4;

/// Vector of of(0) to of(7).
template <typename Of>
PICTURA_HD inline Int16x8 make_int16x8(Of&& of) {
  Int16x8 result;
#if defined(__CUDA_ARCH__)
  for (int k = 0; k < kInt16x8Half; ++k) {
    result.halves[k] = static_cast<uint32_t>(of(k)) & 0xFFFFu | static_cast<uint32_t>(of(k + kInt16x8Half)) << 16;
  }
#else
  for (int k = 0; k < kInt16x8Size; ++k) result.value[k] = static_cast<int16_t>(of(k));
#endif
  return result;
}

/// Element k is base + (k - 4) * step, which must be in [0, 65,536).
PICTURA_HD inline Int16x8 arithmetic_sequence(int32_t step, int32_t base) {
#if defined(__CUDA_ARCH__)
  Int16x8 result;
  for (int k = 0; k < kInt16x8Half; ++k) {
    result.halves[k] =
        static_cast<uint32_t>(step * ((k << 16) + k - kInt16x8Half)) + static_cast<uint32_t>(base) * 0x10001u;
  }
  return result;
#else
  const Uint16Vector steps{0xFFFC, 0xFFFD, 0xFFFE, 0xFFFF, 0, 1, 2, 3};
  return {reinterpret_cast<Int16Vector>(steps * static_cast<uint16_t>(step) + static_cast<uint16_t>(base))};
#endif
}

/// Copies the lower half of `word` to both halves.
PICTURA_HD inline uint32_t broadcast_low16(uint32_t word) {
#if defined(__CUDA_ARCH__)
  return __byte_perm(word, 0, 0x1010);
#else
  return (word & 0xFFFFu) * 0x10001u;
#endif
}

#if !defined(__CUDA_ARCH__)
/// a + b, wrapping around at 16 bits.
inline Int16Vector wrapped_sum(const Int16x8& a, uint32_t b) {
  return reinterpret_cast<Int16Vector>(reinterpret_cast<Uint16Vector>(a.value) + static_cast<uint16_t>(b));
}
#endif

/// max(a + b, c) and min(a + b, c). Both halves of b must be equal. Sums wrap around at 16 bits.
PICTURA_HD inline Int16x8 add_max(const Int16x8& a, uint32_t b, const Int16x8& c) {
#if defined(__CUDA_ARCH__)
  Int16x8 result;
  for (int k = 0; k < kInt16x8Half; ++k) result.halves[k] = __viaddmax_s16x2(a.halves[k], b, c.halves[k]);
  return result;
#else
  const Int16Vector sum = wrapped_sum(a, b);
  return {sum > c.value ? sum : c.value};
#endif
}
PICTURA_HD inline Int16x8 add_min(const Int16x8& a, uint32_t b, const Int16x8& c) {
#if defined(__CUDA_ARCH__)
  Int16x8 result;
  for (int k = 0; k < kInt16x8Half; ++k) result.halves[k] = __viaddmin_s16x2(a.halves[k], b, c.halves[k]);
  return result;
#else
  const Int16Vector sum = wrapped_sum(a, b);
  return {sum < c.value ? sum : c.value};
#endif
}

/// a + b, clamped to [0, high]. Sums must not overflow 16 bits.
PICTURA_HD inline Int16x8 add_clamp(const Int16x8& a, const Int16x8& b, const Int16x8& high) {
#if defined(__CUDA_ARCH__)
  Int16x8 result;
  for (int k = 0; k < kInt16x8Half; ++k) {
    result.halves[k] = __viaddmin_s16x2_relu(a.halves[k], b.halves[k], high.halves[k]);
  }
  return result;
#else
  const Int16Vector sum = a.value + b.value, bounded = sum < high.value ? sum : high.value, zero{};
  return {bounded > zero ? bounded : zero};
#endif
}

#if defined(__CUDA_ARCH__)
/// Looks up four bytes of `table` by 4-bit selectors. Selector s > 7 gives the sign bit of byte s - 8, in all 8 bits.
__device__ inline uint32_t bytes_of(uint64_t table, uint32_t selectors) {
  uint32_t bytes;
  asm("prmt.b32 %0, %1, %2, %3;"
      : "=r"(bytes)
      : "r"(static_cast<uint32_t>(table)), "r"(static_cast<uint32_t>(table >> 32)), "r"(selectors));
  return bytes;
}
/// Bits 7 to 10 of the elements, as selectors.
__device__ inline uint32_t selectors_of(const Int16x8& a) {
  const uint32_t low = (a.halves[0] >> 7 & 0x000F000Fu) | (a.halves[1] >> 3 & ~0x000F000Fu),
                 high = (a.halves[2] << 1 & 0x0F000F00u) | (a.halves[3] << 5 & ~0x0F000F00u);
  return (low & 0x00FF00FFu) | (high & ~0x00FF00FFu);
}
#endif

/// Byte k of the result has the bits from (from[k] / 128) up to, but excluding, (to[k] / 128). Requires 0 <= from[k] <=
/// to[k] <= 8 * 128.
PICTURA_HD inline uint64_t bits_between(const Int16x8& from, const Int16x8& to) {
#if defined(__CUDA_ARCH__)
  // Byte i is the mask of bits i to 7, with its upper four bits XORed with its lower four. So byte 0 has no sign bit,
  // and selector 8 gives 0.
  constexpr uint64_t kTable = 0x80C0E0F0783C1E0Full;
  constexpr uint32_t kUpperFour = 0xF0F0F0F0u;
  const uint32_t begin = selectors_of(from), end = selectors_of(to);
  const uint32_t low = bytes_of(kTable, begin) ^ bytes_of(kTable, end),
                 high = bytes_of(kTable, begin >> 16) ^ bytes_of(kTable, end >> 16);
  return static_cast<uint64_t>(high ^ (high << 4 & kUpperFour)) << 32 | (low ^ (low << 4 & kUpperFour));
#else
  using Uint32Vector = uint32_t __attribute__((vector_size(32)));
  using Bytes = uint8_t __attribute__((vector_size(8)));
  const Uint32Vector one{1, 1, 1, 1, 1, 1, 1, 1};
  const Uint32Vector bits = (one << __builtin_convertvector(to.value >> 7, Uint32Vector)) -
                            (one << __builtin_convertvector(from.value >> 7, Uint32Vector));
  // Two steps, for which instructions exist.
  const auto bytes = __builtin_convertvector(__builtin_convertvector(bits, Uint16Vector), Bytes);
  return __builtin_bit_cast(uint64_t, bytes);
#endif
}

}  // namespace pictura
