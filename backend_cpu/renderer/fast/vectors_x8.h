// Eight vectors in parallel, one per SIMD lane, with the arithmetic of Vec2 and Vec3 (common/math.h).
#pragma once

#include "pictura/common/portable/float8.h"

namespace pictura {

constexpr int kLanes = 8;
inline Float8 lane_numbers() { return set8(0, 1, 2, 3, 4, 5, 6, 7); }

struct Vec2x8 {
  Float8 x, y;
};
inline Vec2x8 operator+(const Vec2x8& a, const Vec2x8& b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2x8 operator-(const Vec2x8& a, const Vec2x8& b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2x8 operator*(const Vec2x8& a, const Float8& s) { return {a.x * s, a.y * s}; }
inline Float8 dot(const Vec2x8& a, const Vec2x8& b) { return a.x * b.x + a.y * b.y; }
inline Float8 cross(const Vec2x8& a, const Vec2x8& b) { return a.x * b.y - a.y * b.x; }

struct Vec3x8 {
  Float8 x, y, z;
};
inline Vec3x8 operator+(const Vec3x8& a, const Vec3x8& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3x8 operator-(const Vec3x8& a, const Vec3x8& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Float8 dot(const Vec3x8& a, const Vec3x8& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3x8 cross(const Vec3x8& a, const Vec3x8& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace pictura
