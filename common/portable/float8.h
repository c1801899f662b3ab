// SIMD on eight floats: AVX2 on a host, otherwise scalar code. The bits are equal everywhere.
#pragma once

#include "pictura/common/portable/hd.h"
#include "pictura/common/portable/intrinsics.h"
#if defined(__AVX2__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

namespace pictura {

// Two namespaces, because programs may mix code with and without AVX2, and the two kinds of code pass a Float8 to
// functions differently.
#if defined(__AVX2__) && !defined(__CUDACC__)
inline namespace float8_in_a_register {

struct Float8 {
  __m256 value;
  Float8() = default;
  Float8(__m256 elements) : value(elements) {}
  Float8(float of_all) : value(_mm256_set1_ps(of_all)) {}
  float operator[](int k) const { return value[k]; }
};
inline Float8 set8(float a, float b, float c, float d, float e, float f, float g, float h) {
  return {_mm256_setr_ps(a, b, c, d, e, f, g, h)};
}
inline Float8 load8(const float* from) { return {_mm256_loadu_ps(from)}; }
inline void store8(const Float8& a, float* to) { _mm256_storeu_ps(to, a.value); }
/// A float must represent each integer exactly.
inline Float8 load8_integers(const int32_t* from) {
  return {_mm256_cvtepi32_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)))};
}
inline void store8_integers(const Float8& a, int32_t* to) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_cvttps_epi32(a.value));
}
inline Float8 operator+(const Float8& a, const Float8& b) { return {_mm256_add_ps(a.value, b.value)}; }
inline Float8 operator-(const Float8& a, const Float8& b) { return {_mm256_sub_ps(a.value, b.value)}; }
inline Float8 operator*(const Float8& a, const Float8& b) { return {_mm256_mul_ps(a.value, b.value)}; }
inline Float8 operator/(const Float8& a, const Float8& b) { return {_mm256_div_ps(a.value, b.value)}; }
inline Float8 operator-(const Float8& a) { return {_mm256_xor_ps(_mm256_set1_ps(-0.0f), a.value)}; }
inline Float8 magnitude(const Float8& a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.value)}; }
inline Float8 round_down(const Float8& a) { return {_mm256_floor_ps(a.value)}; }
inline Float8 round_up(const Float8& a) { return {_mm256_ceil_ps(a.value)}; }
/// Lane-wise versions of the scalar functions.
inline Float8 min_no_nan(const Float8& a, const Float8& b) { return {_mm256_min_ps(a.value, b.value)}; }
inline Float8 max_no_nan(const Float8& a, const Float8& b) { return {_mm256_max_ps(a.value, b.value)}; }
inline Float8 sqrt_in_range(const Float8& a) { return {_mm256_sqrt_ps(a.value)}; }
/// Bitwise AND of each element with `bits`.
inline Float8 keep_bits(const Float8& a, uint32_t bits) {
  return {_mm256_and_ps(a.value, _mm256_castsi256_ps(_mm256_set1_epi32(static_cast<int32_t>(bits))))};
}

/// A mask: all bits of an element are set, or none.
struct Mask8 {
  __m256 bits;
};
inline Mask8 operator&(const Mask8& a, const Mask8& b) { return {_mm256_and_ps(a.bits, b.bits)}; }
inline Mask8 operator|(const Mask8& a, const Mask8& b) { return {_mm256_or_ps(a.bits, b.bits)}; }
inline Mask8 operator^(const Mask8& a, const Mask8& b) { return {_mm256_xor_ps(a.bits, b.bits)}; }
inline Mask8 operator~(const Mask8& a) { return {_mm256_xor_ps(a.bits, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))}; }
inline Mask8 operator<(const Float8& a, const Float8& b) { return {_mm256_cmp_ps(a.value, b.value, _CMP_LT_OQ)}; }
inline Mask8 operator<=(const Float8& a, const Float8& b) { return {_mm256_cmp_ps(a.value, b.value, _CMP_LE_OQ)}; }
/// Compares the bits as unsigned integers.
inline Mask8 less_bits(const Float8& a, const Float8& b) {
  const __m256i lowest = _mm256_set1_epi32(INT32_MIN);
  const __m256i of_a = _mm256_xor_si256(_mm256_castps_si256(a.value), lowest);
  const __m256i of_b = _mm256_xor_si256(_mm256_castps_si256(b.value), lowest);
  return {_mm256_castsi256_ps(_mm256_cmpgt_epi32(of_b, of_a))};
}
inline Mask8 equal_bits(const Float8& a, const Float8& b) {
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_castps_si256(a.value), _mm256_castps_si256(b.value)))};
}
/// Returns an integer whose bit k is element k.
inline uint32_t bits_of(const Mask8& mask) { return static_cast<uint32_t>(_mm256_movemask_ps(mask.bits)); }
/// Element k of a where element k of the mask is set, else of b.
inline Float8 select(const Mask8& mask, const Float8& a, const Float8& b) {
  return {_mm256_blendv_ps(b.value, a.value, mask.bits)};
}

/// Exchanges elements 2k and 2k + 1.
inline Float8 swap_pairs(const Float8& a) { return {_mm256_permute_ps(a.value, 0xB1)}; }

/// Element k of b where bit k of kMask is set, else of a.
template <int kMask>
inline Float8 blend(const Float8& a, const Float8& b) {
  return {_mm256_blend_ps(a.value, b.value, kMask)};
}

/// Returns the elements k0 to k7 of a.
template <int k0, int k1, int k2, int k3, int k4, int k5, int k6, int k7>
inline Float8 permute(const Float8& a) {
  return {_mm256_permutevar8x32_ps(a.value, _mm256_setr_epi32(k0, k1, k2, k3, k4, k5, k6, k7))};
}

/// Loads eight pairs, and separates first from second elements.
inline void load_pairs(const float* from, Float8* first_out, Float8* second_out) {
  const __m256 a = _mm256_loadu_ps(from), b = _mm256_loadu_ps(from + 8);
  const __m256 low = _mm256_permute2f128_ps(a, b, 0x20), high = _mm256_permute2f128_ps(a, b, 0x31);
  first_out->value = _mm256_shuffle_ps(low, high, 0x88);
  second_out->value = _mm256_shuffle_ps(low, high, 0xDD);
}
/// Loads the pairs with these indices, as load_pairs() does.
inline void gather_pairs(const float* from, const int32_t* indices, Float8* first_out, Float8* second_out) {
  const auto two = [&](int k) {
    const auto pair = [&](int i) { return reinterpret_cast<const __m64*>(from + 2 * int64_t{indices[i]}); };
    return _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), pair(k)), pair(k + 1));
  };
  const __m256 low = _mm256_set_m128(two(4), two(0)), high = _mm256_set_m128(two(6), two(2));
  first_out->value = _mm256_shuffle_ps(low, high, 0x88);
  second_out->value = _mm256_shuffle_ps(low, high, 0xDD);
}
/// For each element k, loads four unaligned floats at from(k). Float j becomes element k of four_out[j].
template <typename From>
inline void gather_fours(From&& from, Float8* four_out) {
  // One register holds the four floats of element k (lower half) and of element k + 4.
  const auto two = [&](int k) {
    const auto four = [&](int i) { return _mm_loadu_ps(static_cast<const float*>(from(i))); };
    return _mm256_set_m128(four(k + 4), four(k));
  };
  const __m256 rows[4] = {two(0), two(1), two(2), two(3)};
  const __m256 low_01 = _mm256_unpacklo_ps(rows[0], rows[1]), low_23 = _mm256_unpacklo_ps(rows[2], rows[3]);
  const __m256 high_01 = _mm256_unpackhi_ps(rows[0], rows[1]), high_23 = _mm256_unpackhi_ps(rows[2], rows[3]);
  four_out[0].value = _mm256_shuffle_ps(low_01, low_23, 0x44);
  four_out[1].value = _mm256_shuffle_ps(low_01, low_23, 0xEE);
  four_out[2].value = _mm256_shuffle_ps(high_01, high_23, 0x44);
  four_out[3].value = _mm256_shuffle_ps(high_01, high_23, 0xEE);
}

/// For each byte, the places of its set bits, ascending.
struct SetBits {
  alignas(8) uint8_t places[256][8];
  constexpr SetBits() : places{} {
    for (int byte = 0; byte < 256; ++byte) {
      for (int bit = 0, count = 0; bit < 8; ++bit) {
        if (byte >> bit & 1) places[byte][count++] = static_cast<uint8_t>(bit);
      }
    }
  }
};
inline constexpr SetBits kSetBits;

inline __m256i set_bits(uint32_t mask) {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kSetBits.places[mask])));
}

/// Copies the elements in the mask, without gaps. May overwrite eight elements of `to`.
template <typename Word>
inline void copy_chosen(const Word* from, uint32_t mask, Word* to) {
  static_assert(sizeof(Word) == sizeof(int32_t));
  const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(all, set_bits(mask)));
}
/// Writes first + k for each set bit k, without gaps. May overwrite eight elements of `to`.
inline void store_chosen(int32_t first, uint32_t mask, int32_t* to) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_add_epi32(set_bits(mask), _mm256_set1_epi32(first)));
}
/// Returns an integer whose bit k is set if integer k equals the value.
inline uint32_t equal8(const int32_t* integers, int32_t value) {
  const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(integers));
  const __m256i equal = _mm256_cmpeq_epi32(all, _mm256_set1_epi32(value));
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(equal)));
}

/// The kCount smallest inserted keys, ascending. Keys must be in [0, 0x7FF0...0), where integers are ordered as the
/// doubles with the same bits.
template <int kFours>
struct SmallestKeys {
  static constexpr int kCount = 4 * kFours;
  __m256d keys[kFours];
  static constexpr int64_t kNone = 0x7FEFFFFFFFFFFFFF;

  SmallestKeys() {
    for (__m256d& four : keys) four = _mm256_castsi256_pd(_mm256_set1_epi64x(kNone));
  }
  /// Inserts a key and drops the largest.
  void insert(int64_t key) {
    const __m256d all_new = _mm256_castsi256_pd(_mm256_set1_epi64x(key));
    __m256d carried = _mm256_setzero_pd();  // element before the current four
    for (__m256d& four : keys) {
      const __m256d rotated = _mm256_permute4x64_pd(four, 0x93);
      // An element above the new key becomes the maximum of the new key and the element's predecessor.
      four = _mm256_max_pd(_mm256_min_pd(four, all_new), _mm256_blend_pd(rotated, carried, 1));
      carried = rotated;
    }
  }
  void store(int64_t* to) const {
    for (int k = 0; k < kFours; ++k) _mm256_storeu_pd(reinterpret_cast<double*>(to) + 4 * k, keys[k]);
  }
};
}  // namespace float8_in_a_register
#else
inline namespace float8_in_memory {

struct alignas(32) Float8 {
  float value[8];
  Float8() = default;
  PICTURA_HD Float8(float of_all) {
    for (float& element : value) element = of_all;
  }
  PICTURA_HD float operator[](int k) const { return value[k]; }
};
/// Vector of of(0) to of(7).
template <typename Of>
PICTURA_HD inline Float8 make_float8(Of&& of) {
  Float8 result;
  for (int k = 0; k < 8; ++k) result.value[k] = of(k);
  return result;
}
PICTURA_HD inline Float8 set8(float a, float b, float c, float d, float e, float f, float g, float h) {
  const float elements[8] = {a, b, c, d, e, f, g, h};
  return make_float8([&](int k) { return elements[k]; });
}
PICTURA_HD inline Float8 load8(const float* from) {
  return make_float8([=](int k) { return from[k]; });
}
PICTURA_HD inline void store8(const Float8& a, float* to) {
  for (int k = 0; k < 8; ++k) to[k] = a.value[k];
}
PICTURA_HD inline Float8 load8_integers(const int32_t* from) {
  return make_float8([=](int k) { return static_cast<float>(from[k]); });
}
PICTURA_HD inline void store8_integers(const Float8& a, int32_t* to) {
  for (int k = 0; k < 8; ++k) to[k] = static_cast<int32_t>(a.value[k]);
}
PICTURA_HD inline Float8 operator+(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return a.value[k] + b.value[k]; });
}
PICTURA_HD inline Float8 operator-(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return a.value[k] - b.value[k]; });
}
PICTURA_HD inline Float8 operator*(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return a.value[k] * b.value[k]; });
}
PICTURA_HD inline Float8 operator/(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return a.value[k] / b.value[k]; });
}
PICTURA_HD inline Float8 operator-(const Float8& a) {
  return make_float8([&](int k) { return -a.value[k]; });
}
PICTURA_HD inline Float8 magnitude(const Float8& a) {
  return make_float8([&](int k) { return fabsf(a.value[k]); });
}
PICTURA_HD inline Float8 round_down(const Float8& a) {
  return make_float8([&](int k) { return floorf(a.value[k]); });
}
PICTURA_HD inline Float8 round_up(const Float8& a) {
  return make_float8([&](int k) { return ceilf(a.value[k]); });
}
PICTURA_HD inline Float8 min_no_nan(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return pictura::min_no_nan(a.value[k], b.value[k]); });
}
PICTURA_HD inline Float8 max_no_nan(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return pictura::max_no_nan(a.value[k], b.value[k]); });
}
PICTURA_HD inline Float8 sqrt_in_range(const Float8& a) {
  return make_float8([&](int k) { return pictura::sqrt_in_range(a.value[k]); });
}
PICTURA_HD inline Float8 keep_bits(const Float8& a, uint32_t bits) {
  return make_float8([&](int k) { return float_from_bits(bits_from_float(a.value[k]) & bits); });
}

struct alignas(32) Mask8 {
  int32_t bits[8];
};
/// Mask of is(0) to is(7).
template <typename Is>
PICTURA_HD inline Mask8 make_mask8(Is&& is) {
  Mask8 mask;
  for (int k = 0; k < 8; ++k) mask.bits[k] = is(k) ? -1 : 0;
  return mask;
}
PICTURA_HD inline Mask8 operator&(const Mask8& a, const Mask8& b) {
  return make_mask8([&](int k) { return (a.bits[k] & b.bits[k]) != 0; });
}
PICTURA_HD inline Mask8 operator|(const Mask8& a, const Mask8& b) {
  return make_mask8([&](int k) { return (a.bits[k] | b.bits[k]) != 0; });
}
PICTURA_HD inline Mask8 operator^(const Mask8& a, const Mask8& b) {
  return make_mask8([&](int k) { return (a.bits[k] ^ b.bits[k]) != 0; });
}
PICTURA_HD inline Mask8 operator~(const Mask8& a) {
  return make_mask8([&](int k) { return a.bits[k] == 0; });
}
PICTURA_HD inline Mask8 operator<(const Float8& a, const Float8& b) {
  return make_mask8([&](int k) { return a.value[k] < b.value[k]; });
}
PICTURA_HD inline Mask8 operator<=(const Float8& a, const Float8& b) {
  return make_mask8([&](int k) { return a.value[k] <= b.value[k]; });
}
PICTURA_HD inline Mask8 less_bits(const Float8& a, const Float8& b) {
  return make_mask8([&](int k) { return bits_from_float(a.value[k]) < bits_from_float(b.value[k]); });
}
PICTURA_HD inline Mask8 equal_bits(const Float8& a, const Float8& b) {
  return make_mask8([&](int k) { return bits_from_float(a.value[k]) == bits_from_float(b.value[k]); });
}
PICTURA_HD inline uint32_t bits_of(const Mask8& mask) {
  uint32_t bits = 0;
  for (int k = 0; k < 8; ++k) bits |= (static_cast<uint32_t>(mask.bits[k]) & 1u) << k;
  return bits;
}
PICTURA_HD inline Float8 select(const Mask8& mask, const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return mask.bits[k] != 0 ? a.value[k] : b.value[k]; });
}

PICTURA_HD inline Float8 swap_pairs(const Float8& a) {
  return make_float8([&](int k) { return a.value[k ^ 1]; });
}
template <int kMask>
PICTURA_HD inline Float8 blend(const Float8& a, const Float8& b) {
  return make_float8([&](int k) { return kMask >> k & 1 ? b.value[k] : a.value[k]; });
}
template <int k0, int k1, int k2, int k3, int k4, int k5, int k6, int k7>
PICTURA_HD inline Float8 permute(const Float8& a) {
  return set8(a.value[k0], a.value[k1], a.value[k2], a.value[k3], a.value[k4], a.value[k5], a.value[k6], a.value[k7]);
}
PICTURA_HD inline void load_pairs(const float* from, Float8* first_out, Float8* second_out) {
  *first_out = make_float8([=](int k) { return from[2 * k]; });
  *second_out = make_float8([=](int k) { return from[2 * k + 1]; });
}
PICTURA_HD inline void gather_pairs(const float* from, const int32_t* indices, Float8* first_out, Float8* second_out) {
  *first_out = make_float8([=](int k) { return from[2 * int64_t{indices[k]}]; });
  *second_out = make_float8([=](int k) { return from[2 * int64_t{indices[k]} + 1]; });
}
template <typename From>
PICTURA_HD inline void gather_fours(From&& from, Float8* four_out) {
  for (int k = 0; k < 8; ++k) {
    float four[4];
    __builtin_memcpy(four, from(k), sizeof(four));
    for (int i = 0; i < 4; ++i) four_out[i].value[k] = four[i];
  }
}
template <typename Word>
PICTURA_HD inline void copy_chosen(const Word* from, uint32_t mask, Word* to) {
  for (int k = 0, count = 0; k < 8; ++k) {
    to[count] = from[k];
    count += mask >> k & 1;
  }
}
PICTURA_HD inline void store_chosen(int32_t first, uint32_t mask, int32_t* to) {
  for (int k = 0, count = 0; k < 8; ++k) {
    to[count] = first + k;
    count += mask >> k & 1;
  }
}
PICTURA_HD inline uint32_t equal8(const int32_t* integers, int32_t value) {
  uint32_t bits = 0;
  for (int k = 0; k < 8; ++k) bits |= static_cast<uint32_t>(integers[k] == value) << k;
  return bits;
}

template <int kFours>
struct alignas(32) SmallestKeys {
  static constexpr int kCount = 4 * kFours;
  int64_t keys[kCount];
  static constexpr int64_t kNone = 0x7FEFFFFFFFFFFFFF;

  PICTURA_HD SmallestKeys() {
    for (int64_t& key : keys) key = kNone;
  }
  PICTURA_HD void insert(int64_t key) {
    for (int k = kCount - 1; k >= 0; --k) {
      const int64_t least = keys[k] < key ? keys[k] : key;
      keys[k] = k > 0 && keys[k - 1] > least ? keys[k - 1] : least;
    }
  }
  PICTURA_HD void store(int64_t* to) const {
    for (int k = 0; k < kCount; ++k) to[k] = keys[k];
  }
};
}  // namespace float8_in_memory
#endif

PICTURA_HD inline Mask8 operator>(const Float8& a, const Float8& b) { return b < a; }
PICTURA_HD inline Mask8 operator>=(const Float8& a, const Float8& b) { return b <= a; }
/// Lane-wise versions of the scalar functions.
PICTURA_HD inline Float8 reciprocal_in_range(const Float8& a) { return 1.0f / a; }
PICTURA_HD inline Float8 saturate(const Float8& a) { return min_no_nan(max_no_nan(a, 0.0f), 1.0f); }

/// Masks of the first or last `count` of eight elements. first_lanes_mask() accepts any count.
PICTURA_HD constexpr uint32_t first_lanes_mask(int count) {
  return count >= 8 ? 0xFFu : count <= 0 ? 0u : (1u << count) - 1;
}
PICTURA_HD constexpr uint32_t last_lanes_mask(int count) { return 0xFFu << (8 - count) & 0xFF; }

}  // namespace pictura
