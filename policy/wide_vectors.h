// Vectors of 16 floats on processors with AVX-512, selected at run time, so that programs also run on processors
// without AVX-512.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define PICTURA_HAS_WIDE_VECTORS 1
/// Attribute of a function that may be called only if has_wide_vectors() is true. Functions that are inlined into it
/// may use AVX-512 too.
#define PICTURA_WIDE [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl,fma")]]
#else
#define PICTURA_HAS_WIDE_VECTORS 0
#define PICTURA_WIDE
#endif

/// Attribute of a function that is always inlined, and so is compiled for the processor of its caller.
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

/// Vector of kFloats floats. It needs no alignment: it may begin at any float in memory.
template <int kFloats>
struct VectorOf {
  typedef float Type __attribute__((vector_size(kFloats * sizeof(float)), aligned(alignof(float)), may_alias));
};

template <int kFloats>
PICTURA_INLINE const typename VectorOf<kFloats>::Type& vector_at(const float* from) {
  return *reinterpret_cast<const typename VectorOf<kFloats>::Type*>(from);
}
template <int kFloats>
PICTURA_INLINE typename VectorOf<kFloats>::Type& vector_at(float* from) {
  return *reinterpret_cast<typename VectorOf<kFloats>::Type*>(from);
}

}  // namespace pictura::host
