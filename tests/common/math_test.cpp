// pictura's transcendental functions compared with those of libm in double precision, over their documented ranges.
#include "pictura/common/math.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/common/hypot.h"
#include "pictura/common/support/hash.h"

namespace pictura {
namespace {

TEST(Math, SineAndCosineAreWithin2e7OverTenThousandRadians) {
  double worst = 0;
  for (int i = -200000; i <= 200000; ++i) {
    const float x = static_cast<float>(i) * 0.05f;
    const SinCos sc = sincos_of(x);
    worst = std::max({worst, std::abs(sc.sin - std::sin(double{x})), std::abs(sc.cos - std::cos(double{x}))});
  }
  EXPECT_LT(worst, 2e-7);
}

TEST(Math, ArcTangentIsWithin2e7InEveryQuadrant) {
  double worst = 0;
  for (int i = 0; i < 3600; ++i) {
    const double angle = (i - 1800) * 3.14159265358979 / 1800.0;
    for (const double radius : {1e-3, 1.0, 1e4}) {
      const auto y = static_cast<float>(radius * std::sin(angle)), x = static_cast<float>(radius * std::cos(angle));
      worst = std::max(worst, std::abs(atan2_of(y, x) - std::atan2(double{y}, double{x})));
    }
  }
  EXPECT_LT(worst, 4e-7);  // near pi one step of a float is 2.4e-7
  EXPECT_EQ(atan2_of(0.0f, 0.0f), 0.0f);
  EXPECT_EQ(atan2_of(-2.0f, 0.0f), -kHalfPi);
}

TEST(Math, ExponentialIsWithin2e7Relative) {
  for (int i = -8600; i <= 8700; ++i) {
    const float x = static_cast<float>(i) * 0.01f;
    const double truth = std::exp(double{x});
    ASSERT_NEAR(exp_of(x) / truth, 1.0, 2e-7) << "x = " << x;
  }
  EXPECT_EQ(exp_of(-100.0f), 0.0f);
  EXPECT_TRUE(std::isfinite(exp_of(1000.0f)));
  EXPECT_TRUE(std::isfinite(exp_of(std::numeric_limits<float>::infinity())));
  EXPECT_EQ(exp_of(-std::numeric_limits<float>::infinity()), 0.0f);
  EXPECT_TRUE(std::isnan(exp_of(std::numeric_limits<float>::quiet_NaN())));
}

TEST(Math, WrappedAnglesAreWithinPiAndKeepTheirDirection) {
  for (int i = -1000; i <= 1000; ++i) {
    const float x = static_cast<float>(i) * 0.37f;
    const float wrapped = wrap_angle(x);
    ASSERT_LE(std::abs(wrapped), kPi);
    ASSERT_NEAR(std::sin(double{wrapped}), std::sin(double{x}), 3e-5);
    ASSERT_NEAR(std::cos(double{wrapped}), std::cos(double{x}), 3e-5);
  }
}

TEST(Math, LengthsAreWithinOneUlpAndEqualOnAllProcessors) {
  Hash64 hash;
  for (int i = 0; i <= 1000; ++i) {
    for (const double scale : {0x1p-60, 1e-9, 0.01, 1.0, 1e6}) {
      const double x = -300 + 0.7 * i, y = scale * (250 - 0.3 * i);
      const double length = hypot_of(x, y);
      const long double truth = std::sqrt(static_cast<long double>(x) * x + static_cast<long double>(y) * y);
      ASSERT_LE(std::abs(length - truth), std::nextafter(length, 1e300) - length) << "x = " << x << ", y = " << y;
      ASSERT_EQ(hypot_of(y, -x), length);
      hash.add_bytes(&length, sizeof length);
    }
  }
  EXPECT_EQ(hash.hex(), "3fd18bbd3112f9fb");  // measured on x86-64 and on aarch64
  EXPECT_EQ(hypot_of(0, 0), 0);
  EXPECT_DOUBLE_EQ(hypot_of(3e200, -4e200), 5e200);
  EXPECT_DOUBLE_EQ(hypot_of(-3e-200, 4e-200), 5e-200);
}

TEST(Math, CrossProductIsPositiveToTheLeft) {
  EXPECT_GT(cross(Vec2{1, 0}, Vec2{0, 1}), 0.0f);
  const Vec3 up = cross(Vec3{1, 0, 0}, Vec3{0, 1, 0});
  EXPECT_EQ(up.z, 1.0f);
  EXPECT_EQ(left_normal(Vec2{1, 0}).y, 1.0f);
}

}  // namespace
}  // namespace pictura
