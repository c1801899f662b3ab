// Vectors of 16 floats on processors with AVX-512, selected at run time.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define PICTURA_HAS_WIDE_VECTORS 1
/// Attribute of a function that may only run if has_wide_vectors(). Functions inlined into it may use AVX-512 too.
#define PICTURA_WIDE [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl,fma")]]
#else
#define PICTURA_HAS_WIDE_VECTORS 0
#define PICTURA_WIDE
#endif

/// Attribute of a function that is always inlined, and so compiled for its caller's instruction set.
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

/// Vector of kFloats floats, aligned like a float.
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
