// Length of a 2D vector in double precision, bitwise equal on all processors. glibc's std::hypot differs where it uses
// fused multiply-add.
#pragma once

#include <algorithm>
#include <cmath>

namespace pictura {

/// Returns sqrt(x^2 + y^2), by the unfused corrected method of C. F. Borges, "An Improved Algorithm for hypot(a,b)",
/// 2019. The error is at most four units in the last place. If the larger of |x| and |y| is in [1e-150, 1e150], the
/// error is at most one unit. The result then equals that of glibc's std::hypot on x86-64.
inline double hypot_of(double x, double y) {
  constexpr double kNegligible = 0x1p-54;  // up to this ratio, the shorter leg only affects rounding
  const double longer = std::max(std::abs(x), std::abs(y)), shorter = std::min(std::abs(x), std::abs(y));
  if (shorter <= longer * kNegligible) return longer + shorter;
  if (longer < 1e-150 || longer > 1e150) {  // squares would overflow or underflow
    const double ratio = shorter / longer;
    return longer * std::sqrt(1 + ratio * ratio);
  }
  const double length = std::sqrt(longer * longer + shorter * shorter);
  // large + small is length^2 - longer^2 - shorter^2. `beyond`, the length minus one leg, is exact.
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
