// SIMD on eight 16-bit integers: one instruction on a host, four on a device.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Eight 16-bit integers. On a device, words hold element k and element k + 4 as halves, for instructions on pairs; on
/// a host, the elements are contiguous, for one register.
struct Int16x8 {
#if defined(__CUDA_ARCH__)
  uint32_t halves[4];
#else
  int16_t value[8];
#endif
};
constexpr int kInt16x8Size = 8, kInt16x8Half = 4;

/// The elements of(0) to of(7).
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

/// Element k is base + (k - 4) * step, which must be in [0, 65,536); its 16 bits are stored.
PICTURA_HD inline Int16x8 arithmetic_sequence(int32_t step, int32_t base) {
#if defined(__CUDA_ARCH__)
  Int16x8 result;
  for (int k = 0; k < kInt16x8Half; ++k) {
    result.halves[k] =
        static_cast<uint32_t>(step * ((k << 16) + k - kInt16x8Half)) + static_cast<uint32_t>(base) * 0x10001u;
  }
  return result;
#else
  return make_int16x8([=](int k) { return base + (k - kInt16x8Half) * step; });
#endif
}

/// A word whose two halves are both the lower half of `word`.
PICTURA_HD inline uint32_t broadcast_low16(uint32_t word) {
#if defined(__CUDA_ARCH__)
  return __byte_perm(word, 0, 0x1010);
#else
  return (word & 0xFFFFu) * 0x10001u;
#endif
}

/// max(a + b, c) and min(a + b, c) for each element; both halves of b must be equal, and sums wrap around at 16 bits.
PICTURA_HD inline Int16x8 add_max(const Int16x8& a, uint32_t b, const Int16x8& c) {
  Int16x8 result;
#if defined(__CUDA_ARCH__)
  for (int k = 0; k < kInt16x8Half; ++k) result.halves[k] = __viaddmax_s16x2(a.halves[k], b, c.halves[k]);
#else
  for (int k = 0; k < kInt16x8Size; ++k) {
    const auto sum = static_cast<int16_t>(static_cast<uint16_t>(a.value[k]) + b);
    result.value[k] = sum > c.value[k] ? sum : c.value[k];
  }
#endif
  return result;
}
PICTURA_HD inline Int16x8 add_min(const Int16x8& a, uint32_t b, const Int16x8& c) {
  Int16x8 result;
#if defined(__CUDA_ARCH__)
  for (int k = 0; k < kInt16x8Half; ++k) result.halves[k] = __viaddmin_s16x2(a.halves[k], b, c.halves[k]);
#else
  for (int k = 0; k < kInt16x8Size; ++k) {
    const auto sum = static_cast<int16_t>(static_cast<uint16_t>(a.value[k]) + b);
    result.value[k] = sum < c.value[k] ? sum : c.value[k];
  }
#endif
  return result;
}

/// a + b, clamped to [0, high], for each element. Sums must not overflow 16 bits.
PICTURA_HD inline Int16x8 add_clamp(const Int16x8& a, const Int16x8& b, const Int16x8& high) {
  Int16x8 result;
#if defined(__CUDA_ARCH__)
  for (int k = 0; k < kInt16x8Half; ++k) {
    result.halves[k] = __viaddmin_s16x2_relu(a.halves[k], b.halves[k], high.halves[k]);
  }
#else
  for (int k = 0; k < kInt16x8Size; ++k) {
    const auto sum = static_cast<int16_t>(a.value[k] + b.value[k]);
    const int16_t bounded = sum < high.value[k] ? sum : high.value[k];
    result.value[k] = bounded > 0 ? bounded : int16_t{0};
  }
#endif
  return result;
}

#if defined(__CUDA_ARCH__)
/// Looks up four bytes of `table` by four selectors of four bits; a selector above 7 gives the sign of byte (selector -
/// 8), replicated over 8 bits (__byte_perm does not).
__device__ inline uint32_t bytes_of(uint64_t table, uint32_t selectors) {
  uint32_t bytes;
  asm("prmt.b32 %0, %1, %2, %3;"
      : "=r"(bytes)
      : "r"(static_cast<uint32_t>(table)), "r"(static_cast<uint32_t>(table >> 32)), "r"(selectors));
  return bytes;
}
/// Bits 7 to 10 of the elements as selectors, those of the first four in the lower half.
__device__ inline uint32_t selectors_of(const Int16x8& a) {
  const uint32_t low = (a.halves[0] >> 7 & 0x000F000Fu) | (a.halves[1] >> 3 & ~0x000F000Fu),
                 high = (a.halves[2] << 1 & 0x0F000F00u) | (a.halves[3] << 5 & ~0x0F000F00u);
  return (low & 0x00FF00FFu) | (high & ~0x00FF00FFu);
}
#endif

/// A bit mask per element: in byte k, the bits from (from[k] / 128) up to but excluding (to[k] / 128) are set. Requires
/// 0 <= from[k] <= to[k] <= 8 * 128.
PICTURA_HD inline uint64_t bits_between(const Int16x8& from, const Int16x8& to) {
#if defined(__CUDA_ARCH__)
  // Byte i of the table is the mask of the bits from i on, except that its upper four bits are XORed with its lower
  // four. So byte 0 has no sign bit, and selector 8 gives 0.
  constexpr uint64_t kTable = 0x80C0E0F0783C1E0Full;
  constexpr uint32_t kUpperFour = 0xF0F0F0F0u;
  const uint32_t begin = selectors_of(from), end = selectors_of(to);
  const uint32_t low = bytes_of(kTable, begin) ^ bytes_of(kTable, end),
                 high = bytes_of(kTable, begin >> 16) ^ bytes_of(kTable, end >> 16);
  return static_cast<uint64_t>(high ^ (high << 4 & kUpperFour)) << 32 | (low ^ (low << 4 & kUpperFour));
#else
  struct Bytes {
    uint8_t byte[kInt16x8Size];
  } bytes;
  for (int k = 0; k < kInt16x8Size; ++k) {
    bytes.byte[k] = static_cast<uint8_t>((1u << (to.value[k] >> 7)) - (1u << (from.value[k] >> 7)));
  }
  return __builtin_bit_cast(uint64_t, bytes);
#endif
}

}  // namespace pictura
