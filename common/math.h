// Small vectors, and transcendental functions that are bitwise equal on host and CUDA devices. The functions are
// single-precision polynomials after S. Moshier's Cephes.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

constexpr float kPi = 3.14159265358979323846f;
constexpr float kTwoPi = 6.28318530717958647692f;
constexpr float kHalfPi = 1.57079632679489661923f;
PICTURA_HD constexpr float radians_of(double degrees) {
  return static_cast<float>(degrees * (3.14159265358979323846 / 180.0));
}

struct Vec2 {
  float x = 0, y = 0;
};

struct Vec3 {
  float x = 0, y = 0, z = 0;
  PICTURA_HD constexpr Vec2 xy() const { return {x, y}; }
};

PICTURA_HD constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
PICTURA_HD constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
PICTURA_HD constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }
PICTURA_HD constexpr float dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
/// z of the cross product: positive if b lies to the left of a.
PICTURA_HD constexpr float cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
/// a rotated by 90 degrees counter-clockwise.
PICTURA_HD constexpr Vec2 left_normal(Vec2 a) { return {-a.y, a.x}; }
PICTURA_HD inline float length(Vec2 a) { return sqrtf(dot(a, a)); }

PICTURA_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
PICTURA_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
PICTURA_HD constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
PICTURA_HD constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
PICTURA_HD constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
PICTURA_HD inline float length(Vec3 a) { return sqrtf(dot(a, a)); }

/// Whether the value is at most 3.4e38 in magnitude, and not NaN.
PICTURA_HD inline bool is_finite(float value) { return fabsf(value) <= 3.4e38f; }
PICTURA_HD inline bool is_finite(Vec2 v) { return is_finite(v.x) && is_finite(v.y); }
PICTURA_HD inline bool is_finite(Vec3 v) { return is_finite(v.xy()) && is_finite(v.z); }

PICTURA_HD constexpr float min_of(float a, float b) { return b < a ? b : a; }
PICTURA_HD constexpr float max_of(float a, float b) { return a < b ? b : a; }
PICTURA_HD constexpr int min_of(int a, int b) { return b < a ? b : a; }
PICTURA_HD constexpr int max_of(int a, int b) { return a < b ? b : a; }
PICTURA_HD constexpr float clamp(float x, float low, float high) { return x < low ? low : (high < x ? high : x); }
PICTURA_HD constexpr int clamp(int x, int low, int high) { return x < low ? low : (high < x ? high : x); }
PICTURA_HD constexpr float square(float x) { return x * x; }

struct SinCos {
  float sin, cos;
};

/// Sine and cosine, with an error below 2e-7 for |x_rad| <= 1e4.
PICTURA_HD inline SinCos sincos_of(float x_rad) {
  const float quarter_turns = floorf(x_rad * 0.63661977236758134f + 0.5f);
  // pi/2 is split into three parts, so that products with a small integer are exact (Cody and Waite).
  float r = x_rad - quarter_turns * 1.5703125f;
  r = r - quarter_turns * 4.837512969970703125e-4f;
  r = r - quarter_turns * 7.54978995489188216e-8f;
  const float r2 = r * r;
  const float s = r + r * r2 * (-1.6666654611e-1f + r2 * (8.3321608736e-3f + r2 * -1.9515295891e-4f));
  const float c =
      1.0f - 0.5f * r2 + r2 * r2 * (4.166664568298827e-2f + r2 * (-1.388731625493765e-3f + r2 * 2.443315711809948e-5f));
  switch (static_cast<int>(quarter_turns) & 3) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

PICTURA_HD inline float sin_of(float x_rad) { return sincos_of(x_rad).sin; }
PICTURA_HD inline float cos_of(float x_rad) { return sincos_of(x_rad).cos; }
PICTURA_HD inline float tan_of(float x_rad) {
  const SinCos sc = sincos_of(x_rad);
  return sc.sin / sc.cos;
}

/// Arc tangent in (-pi/2, pi/2), with an error below 2e-7.
PICTURA_HD inline float atan_of(float x) {
  const float magnitude = fabsf(x);
  float offset = 0.0f;
  float t = magnitude;
  if (magnitude > 2.414213562373095f) {
    offset = kHalfPi;
    t = -1.0f / magnitude;
  } else if (magnitude > 0.4142135623730950f) {
    offset = 0.25f * kPi;
    t = (magnitude - 1.0f) / (magnitude + 1.0f);
  }
  const float t2 = t * t;
  const float y =
      offset +
      ((((8.05374449538e-2f * t2 - 1.38776856032e-1f) * t2 + 1.99777106478e-1f) * t2 - 3.33329491539e-1f) * t2 * t + t);
  return x < 0.0f ? -y : y;
}

/// Angle of the vector (x, y), in [-pi, pi]; 0 for the null vector.
PICTURA_HD inline float atan2_of(float y, float x) {
  if (x == 0.0f) return y > 0.0f ? kHalfPi : (y < 0.0f ? -kHalfPi : 0.0f);
  const float angle = atan_of(y / x);
  if (x > 0.0f) return angle;
  return y < 0.0f ? angle - kPi : angle + kPi;
}

/// e^x, with a relative error below 2e-7. Below x = -87, the result is 0. x is clamped to 88. NaN gives NaN.
PICTURA_HD inline float exp_of(float x) {
  if (!(x >= -87.0f)) return x < -87.0f ? 0.0f : x;
  x = min_of(x, 88.0f);
  const float n = floorf(x * 1.44269504088896341f + 0.5f);
  float r = x - n * 0.693359375f;
  r = r + n * 2.12194440e-4f;
  const float p = ((((1.9875691500e-4f * r + 1.3981999507e-3f) * r + 8.3334519073e-3f) * r + 4.1665795894e-2f) * r +
                   1.6666665459e-1f) *
                      r +
                  5.0000001201e-1f;
  float y = p * r * r + r + 1.0f;
  // 2^n by repeated squaring, which is exact.
  int k = static_cast<int>(n);
  const float base = k < 0 ? 0.5f : 2.0f;
  k = k < 0 ? -k : k;
  float power = base;
  for (; k > 0; k >>= 1) {
    if (k & 1) y = y * power;
    if (k > 1) power = power * power;
  }
  return y;
}

/// Returns x_rad minus whole turns, in [-pi, pi].
PICTURA_HD inline float wrap_angle(float x_rad) {
  const float wrapped = x_rad - kTwoPi * floorf(x_rad * (1.0f / kTwoPi) + 0.5f);
  return clamp(wrapped, -kPi, kPi);
}

}  // namespace pictura
