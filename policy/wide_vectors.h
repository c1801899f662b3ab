// Vectors of sixteen floats on processors that have them (AVX-512), for programs that run on those without, too.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define PICTURA_HAS_WIDE_VECTORS 1
/// Of a function that is called only where has_wide_vectors() says so; what it inlines is compiled as it is.
#define PICTURA_WIDE [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl,fma")]]
#else
#define PICTURA_HAS_WIDE_VECTORS 0
#define PICTURA_WIDE
#endif

/// Of a function whose code is for the processor of the function that calls it.
#define PICTURA_INLINE [[gnu::always_inline]] inline

namespace pictura::host {

inline bool has_wide_vectors() {
#if PICTURA_HAS_WIDE_VECTORS
  static const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  return has;
#else
  return false;
#endif
}

}  // namespace pictura::host
