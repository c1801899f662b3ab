// Length of a 2D vector in double precision, bitwise equal on all processors. std::hypot of glibc 2.35 and later is not
// bitwise equal: if glibc was compiled for fused multiply-add (as on aarch64), an eighth of the results differ in the
// last bit.
#pragma once

#include <algorithm>
#include <cmath>

namespace pictura {

/// Returns sqrt(x^2 + y^2). The error is at most one unit in the last place if the larger of |x| and |y| is in [1e-150,
/// 1e150], else at most four units. The method is the unfused corrected square root of C. F. Borges, "An Improved
/// Algorithm for hypot(a,b)", 2019. Coordinates of maps depend on the exact bits of the result. In the range above, the
/// result equals that of glibc's std::hypot on x86-64.
inline double hypot_of(double x, double y) {
  constexpr double kNegligible = 0x1p-54;  // up to this ratio, the shorter leg affects only the rounding
  const double longer = std::max(std::abs(x), std::abs(y)), shorter = std::min(std::abs(x), std::abs(y));
  if (shorter <= longer * kNegligible) return longer + shorter;
  if (longer < 1e-150 || longer > 1e150) {  // squares would leave the range of double
    const double ratio = shorter / longer;
    return longer * std::sqrt(1 + ratio * ratio);
  }
  const double length = std::sqrt(longer * longer + shorter * shorter);
  // The sum large + small is length^2 - longer^2 - shorter^2. Both terms are computed from `beyond`, the difference
  // between the length and one leg, because this difference is exact.
  double large = 0, small = 0;
  if (length <= 2 * shorter) {
    const double beyond = length - shorter;
    large = longer * (2 * beyond - longer);
    small = (beyond - 2 * (longer - shorter)) * beyond;
  } else {
    const double beyond = length - longer;
    large = 2 * beyond * (longer - 2 * shorter);
    small = (4 * beyond - shorter) * shorter + beyond * beyond;
  }
  return length - (large + small) / (2 * length);
}

}  // namespace pictura
