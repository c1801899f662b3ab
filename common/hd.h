// Host-device vocabulary: PICTURA_HD marks a function that runs on both devices. This is the only file that asks which
// compiler reads it; it gives every other shared header its fixed-width integers and C maths, also under NVRTC, which
// has no standard library.
#pragma once

#if defined(__CUDACC__)
#define PICTURA_HD __host__ __device__
#else
#define PICTURA_HD
#endif
// Before a loop that a kernel keeps as it is written: unrolled, the code of a kernel does not fit into the instruction
// caches, and waiting for instructions costs more than a loop does.
#if defined(__CUDA_ARCH__)
#define PICTURA_NO_UNROLL _Pragma("unroll 1")
#else
#define PICTURA_NO_UNROLL
#endif
// Before a loop over the corners of a face, of which nearly all have four: those stay in registers then.
#if defined(__CUDA_ARCH__)
#define PICTURA_UNROLL_FOUR _Pragma("unroll 4")
#else
#define PICTURA_UNROLL_FOUR
#endif

#if defined(__CUDACC_RTC__)
namespace pictura {
using uint8_t = unsigned char;
using int16_t = short;
using int32_t = int;
using uint16_t = unsigned short;
using uint32_t = unsigned int;
using int64_t = long long;
using uint64_t = unsigned long long;
using size_t = unsigned long;
using uintptr_t = unsigned long;
}  // namespace pictura
#else
#include <cmath>
#include <cstddef>
#include <cstdint>
namespace pictura {
using std::int16_t;
using std::int32_t;
using std::int64_t;
using std::size_t;
using std::uint16_t;
using std::uint32_t;
using std::uint64_t;
using std::uint8_t;
using std::uintptr_t;
}  // namespace pictura
#endif

namespace pictura {

/// x within [0, 1]; one instruction of a device.
PICTURA_HD inline float saturate(float x) {
#if defined(__CUDA_ARCH__)
  return __saturatef(x);
#else
  return x < 0.0f ? 0.0f : (1.0f < x ? 1.0f : x);
#endif
}

/// 1 / x and the square root of x, for a magnitude of x between 2^-100 and 2^100, rounded to nearest as IEEE demands. A
/// device takes the steps that its compiler takes for numbers of that range, without asking first whether x is one.
PICTURA_HD inline float reciprocal_in_range(float x) {
#if defined(__CUDA_ARCH__)
  float guess;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(x));
  return __fmaf_rn(guess, __fmaf_rn(-x, guess, 1.0f), guess);
#else
  return 1.0f / x;
#endif
}
PICTURA_HD inline float sqrt_in_range(float x) {
#if defined(__CUDA_ARCH__)
  float inverse_guess;
  asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(inverse_guess) : "f"(x));
  const float guess = x * inverse_guess;
  return __fmaf_rn(__fmaf_rn(-guess, guess, x), 0.5f * inverse_guess, guess);
#else
  return sqrtf(x);
#endif
}

/// The number that a word is.
PICTURA_HD inline float float_from_bits(uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  float number;
  __builtin_memcpy(&number, &bits, sizeof(number));
  return number;
#endif
}

/// Copies 8 bytes, aligned to as many, into a block's shared memory. A device goes on meanwhile: they are there once
/// the same thread has waited for its copies.
PICTURA_HD inline void copy_into_shared(void* to, const void* from) {
#if defined(__CUDA_ARCH__)
  asm volatile("cp.async.ca.shared.global [%0], [%1], 8;"
               :
               : "r"(static_cast<uint32_t>(__cvta_generic_to_shared(to))), "l"(from)
               : "memory");
#else
  __builtin_memcpy(to, from, 8);
#endif
}
PICTURA_HD inline void wait_for_copies() {
#if defined(__CUDA_ARCH__)
  asm volatile("cp.async.wait_all;" : : : "memory");
#endif
}

/// Asks for the memory around an address, which is read soon.
PICTURA_HD inline void prefetch([[maybe_unused]] const void* address) {
#if defined(__CUDA_ARCH__)
  asm volatile("prefetch.global.L2 [%0];" : : "l"(address));
#endif
}

/// A launch may begin before the one before it on its stream has ended. Waits for that, and for all that it wrote.
PICTURA_HD inline void wait_for_earlier_launch() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  asm volatile("griddepcontrol.wait;" : : : "memory");
#endif
}

/// The lesser and the greater of two numbers that are numbers; one instruction of a device. Of two zeros it is either.
PICTURA_HD inline float min_no_nan(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}
PICTURA_HD inline float max_no_nan(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}

/// The bits of a number.
PICTURA_HD inline uint32_t bits_from_float(float x) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(x);
#else
  return __builtin_bit_cast(uint32_t, x);
#endif
}

/// x itself, computed before and not anew at each use: a device's compiler moves what seems cheap into loops.
PICTURA_HD inline float no_rematerialize(float x) {
#if defined(__CUDA_ARCH__)
  asm volatile("" : "+f"(x));
#endif
  return x;
}

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

/// Number of bits that are set.
PICTURA_HD inline int popcount(uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __popcll(bits);
#else
  return __builtin_popcountll(bits);
#endif
}

}  // namespace pictura
