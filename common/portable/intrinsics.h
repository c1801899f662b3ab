// Scalar operations that are fast on a CUDA device. Results on host and device are bitwise equal.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// 1 / x and sqrt(x), correctly rounded (IEEE 754), for |x| in [2^-100, 2^100]. The device code omits the compiler's
/// test of the range.
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

PICTURA_HD inline float float_from_bits(uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  float number;
  __builtin_memcpy(&number, &bits, sizeof(number));
  return number;
#endif
}

/// Arguments must not be NaN. For +0 and -0, either may be returned.
PICTURA_HD inline float min_no_nan(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#elif defined(__AVX__)
  // Assembly, because if b is a constant, g++ 12 emits a branch, which is often mispredicted.
  float minimum;
  asm("vminss %2, %1, %0" : "=x"(minimum) : "x"(a), "xm"(b));
  return minimum;
#else
  return a < b ? a : b;
#endif
}
PICTURA_HD inline float max_no_nan(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#elif defined(__AVX__)
  float greatest;
  asm("vmaxss %2, %1, %0" : "=x"(greatest) : "x"(a), "xm"(b));
  return greatest;
#else
  return a > b ? a : b;
#endif
}

/// x clamped to [0, 1]; x must not be NaN.
PICTURA_HD inline float saturate(float x) {
#if defined(__CUDA_ARCH__)
  return __saturatef(x);
#else
  return min_no_nan(max_no_nan(x, 0.0f), 1.0f);
#endif
}

PICTURA_HD inline uint32_t bits_from_float(float x) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(x);
#else
  return __builtin_bit_cast(uint32_t, x);
#endif
}

/// Returns x. Prevents the CUDA compiler from computing x again within loops.
PICTURA_HD inline float no_rematerialize(float x) {
#if defined(__CUDA_ARCH__)
  asm volatile("" : "+f"(x));
#endif
  return x;
}

PICTURA_HD inline int popcount(uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __popcll(bits);
#else
  return __builtin_popcountll(bits);
#endif
}

}  // namespace pictura
