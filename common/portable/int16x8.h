// Eight 16-bit integers, on which one instruction of a host, or four of a device, does the same.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Eight numbers of 16 bits. A device holds number k and number k + 4 as the halves of a word, on which one instruction
/// does the same; a host holds them one after the other, in one register.
struct Int16x8 {
#if defined(__CUDA_ARCH__)
  uint32_t halves[4];
#else
  int16_t value[8];
#endif
};
constexpr int kInt16x8Size = 8, kInt16x8Half = 4;

/// Numbers of(0) to of(7).
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

/// base + (k - 4) * step, which lie in [0, 65,536), of which numbers keep the bits.
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

/// The lower half of a word, in both of its halves.
PICTURA_HD inline uint32_t broadcast_low16(uint32_t word) {
#if defined(__CUDA_ARCH__)
  return __byte_perm(word, 0, 0x1010);
#else
  return (word & 0xFFFFu) * 0x10001u;
#endif
}

/// Of each number the greater, or the lesser, of a + b and c, where both halves of b hold the same, and what is carried
/// out of a sum's 16 bits is lost.
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

/// a + b within [0, high], where no sum leaves its 16 bits.
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
/// The bytes of `table` that four selectors of four bits name; one above 7 takes the sign of the byte that is 8 less,
/// eight times (__byte_perm does not).
__device__ inline uint32_t bytes_of(uint64_t table, uint32_t selectors) {
  uint32_t bytes;
  asm("prmt.b32 %0, %1, %2, %3;"
      : "=r"(bytes)
      : "r"(static_cast<uint32_t>(table)), "r"(static_cast<uint32_t>(table >> 32)), "r"(selectors));
  return bytes;
}
/// The bits 7 to 10 of the numbers as selectors, those of the first four in the lower half.
__device__ inline uint32_t selectors_of(const Int16x8& a) {
  const uint32_t low = (a.halves[0] >> 7 & 0x000F000Fu) | (a.halves[1] >> 3 & ~0x000F000Fu),
                 high = (a.halves[2] << 1 & 0x0F000F00u) | (a.halves[3] << 5 & ~0x0F000F00u);
  return (low & 0x00FF00FFu) | (high & ~0x00FF00FFu);
}
#endif

/// Byte k has those bits that begin at a 128th of number k of `from` and end before that of `to`. None of `from` is
/// less than 0, more than that of `to`, or more than 8 of 128.
PICTURA_HD inline uint64_t bits_between(const Int16x8& from, const Int16x8& to) {
#if defined(__CUDA_ARCH__)
  // Looked up, for 0 to 8: the bits from there on, but that of the upper four those stand there in which they differ
  // from the lower four. So byte 0 has no sign, and 8 finds none.
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
