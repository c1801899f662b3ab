// Eight floats, the elements of eight objects: arithmetic by the operations of scalars, so that a rule written with
// them has the bits of the scalar one.
#pragma once

#include <cmath>
#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

// Without AVX these types are passed in memory, which concerns inlined functions alone.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace pictura {

constexpr int kLanes = 8;

using FloatVector = float __attribute__((vector_size(32)));
using IntVector = int32_t __attribute__((vector_size(32)));
using UintVector = uint32_t __attribute__((vector_size(32)));

/// For each lane, all bits or none.
struct Mask8 {
  IntVector bits;
};
inline Mask8 operator&(Mask8 a, Mask8 b) { return {a.bits & b.bits}; }
inline Mask8 operator|(Mask8 a, Mask8 b) { return {a.bits | b.bits}; }
inline Mask8 operator^(Mask8 a, Mask8 b) { return {a.bits ^ b.bits}; }
inline Mask8 operator~(Mask8 a) { return {~a.bits}; }
/// Bit i is that of lane i.
inline unsigned lanes_of(Mask8 mask) {
#if defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.bits)));
#else
  unsigned lanes = 0;
  for (int i = 0; i < kLanes; ++i) lanes |= mask.bits[i] != 0 ? 1u << i : 0u;
  return lanes;
#endif
}

/// The lanes below a number of any size.
inline unsigned lanes_below(int number) {
  return number >= kLanes ? (1u << kLanes) - 1 : number <= 0 ? 0u : (1u << number) - 1;
}
/// Writes base + lane for each of the lanes, and something behind them; `to` has room for eight.
inline void store_lanes(unsigned lanes, int32_t base, int32_t* to) {
#if defined(__AVX2__)
  struct Table {
    alignas(8) uint8_t lanes[1 << kLanes][kLanes] = {};
    constexpr Table() {
      for (int mask = 0; mask < 1 << kLanes; ++mask) {
        int count = 0;
        for (int lane = 0; lane < kLanes; ++lane) {
          if ((mask >> lane & 1) != 0) lanes[mask][count++] = static_cast<uint8_t>(lane);
        }
      }
    }
  };
  static constexpr Table kTable;
  const __m128i of_mask = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(kTable.lanes[lanes]));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_add_epi32(_mm256_cvtepu8_epi32(of_mask), _mm256_set1_epi32(base)));
#else
  for (int lane = 0; lane < kLanes; ++lane) {
    if ((lanes >> lane & 1) != 0) *to++ = base + lane;
  }
#endif
}

/// 0 to 7.
constexpr FloatVector kLaneNumbers{0, 1, 2, 3, 4, 5, 6, 7};

struct Float8 {
  FloatVector of_lane;
  Float8() = default;
  Float8(FloatVector vector) : of_lane(vector) {}
  Float8(float of_all) : of_lane(FloatVector{} + of_all) {}
  float operator[](int lane) const { return of_lane[lane]; }
};
inline Float8 load8(const float* from) {
  Float8 result;
  __builtin_memcpy(&result.of_lane, from, sizeof(result.of_lane));
  return result;
}
inline void store8(float* to, Float8 from) { __builtin_memcpy(to, &from.of_lane, sizeof(from.of_lane)); }
inline Float8 operator+(Float8 a, Float8 b) { return a.of_lane + b.of_lane; }
inline Float8 operator-(Float8 a, Float8 b) { return a.of_lane - b.of_lane; }
inline Float8 operator*(Float8 a, Float8 b) { return a.of_lane * b.of_lane; }
inline Float8 operator/(Float8 a, Float8 b) { return a.of_lane / b.of_lane; }
inline Float8 operator-(Float8 a) { return -a.of_lane; }
inline Mask8 operator<(Float8 a, Float8 b) { return {a.of_lane < b.of_lane}; }
inline Mask8 operator<=(Float8 a, Float8 b) { return {a.of_lane <= b.of_lane}; }
inline Mask8 operator>(Float8 a, Float8 b) { return {a.of_lane > b.of_lane}; }
inline Mask8 operator>=(Float8 a, Float8 b) { return {a.of_lane >= b.of_lane}; }
inline Float8 select(Mask8 mask, Float8 a, Float8 b) { return mask.bits ? a.of_lane : b.of_lane; }
inline Float8 min_no_nan(Float8 a, Float8 b) { return a.of_lane < b.of_lane ? a.of_lane : b.of_lane; }
inline Float8 max_no_nan(Float8 a, Float8 b) { return a.of_lane > b.of_lane ? a.of_lane : b.of_lane; }
inline Float8 saturate(Float8 x) { return min_no_nan(max_no_nan(x, 0.0f), 1.0f); }
inline Float8 fabs8(Float8 x) {
  return reinterpret_cast<FloatVector>(reinterpret_cast<IntVector>(x.of_lane) & 0x7FFFFFFF);
}
inline Float8 reciprocal_in_range(Float8 x) { return Float8(1.0f) / x; }
inline Float8 sqrt_in_range(Float8 x) {
#if defined(__AVX2__)
  return reinterpret_cast<FloatVector>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x.of_lane)));
#else
  for (int i = 0; i < kLanes; ++i) x.of_lane[i] = sqrtf(x.of_lane[i]);
  return x;
#endif
}

/// Loads four floats, unaligned, from from(lane) on for each lane.
template <typename From>
inline void transpose_four(From&& from, Float8* floats_out) {
#if defined(__AVX2__)
  // Rows i and i + 4, then pairs of columns.
  __m256 rows[4];
  for (int i = 0; i < 4; ++i) {
    auto row = [&](int lane) { return _mm_loadu_ps(reinterpret_cast<const float*>(from(lane))); };
    rows[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(row(i)), row(i + 4), 1);
  }
  const __m256 low_01 = _mm256_unpacklo_ps(rows[0], rows[1]), low_23 = _mm256_unpacklo_ps(rows[2], rows[3]);
  const __m256 high_01 = _mm256_unpackhi_ps(rows[0], rows[1]), high_23 = _mm256_unpackhi_ps(rows[2], rows[3]);
  floats_out[0] = reinterpret_cast<FloatVector>(_mm256_shuffle_ps(low_01, low_23, 0x44));
  floats_out[1] = reinterpret_cast<FloatVector>(_mm256_shuffle_ps(low_01, low_23, 0xEE));
  floats_out[2] = reinterpret_cast<FloatVector>(_mm256_shuffle_ps(high_01, high_23, 0x44));
  floats_out[3] = reinterpret_cast<FloatVector>(_mm256_shuffle_ps(high_01, high_23, 0xEE));
#else
  for (int lane = 0; lane < kLanes; ++lane) {
    float floats[4];
    __builtin_memcpy(floats, from(lane), sizeof(floats));
    for (int i = 0; i < 4; ++i) floats_out[i].of_lane[lane] = floats[i];
  }
#endif
}

struct Vec2x8 {
  Float8 x, y;
};
inline Vec2x8 operator+(Vec2x8 a, Vec2x8 b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2x8 operator-(Vec2x8 a, Vec2x8 b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2x8 operator*(Vec2x8 a, Float8 s) { return {a.x * s, a.y * s}; }
inline Float8 dot(Vec2x8 a, Vec2x8 b) { return a.x * b.x + a.y * b.y; }
inline Float8 cross(Vec2x8 a, Vec2x8 b) { return a.x * b.y - a.y * b.x; }

struct Vec3x8 {
  Float8 x, y, z;
};
inline Vec3x8 operator+(Vec3x8 a, Vec3x8 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3x8 operator-(Vec3x8 a, Vec3x8 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Float8 dot(Vec3x8 a, Vec3x8 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3x8 cross(Vec3x8 a, Vec3x8 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace pictura
