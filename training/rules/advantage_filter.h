// Advantage filter (paper, appendix, optimization; after Gigaflow): keeps transitions whose |advantage| is not small
// compared with an exponential average over rollouts. The average is over each rollout's largest |advantage|, or over a
// quantile of each rollout's |advantages|.
#pragma once

#include <algorithm>
#include <cstdint>

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/span.h"

namespace pictura {

/// Returns the average after a rollout whose largest |advantage|, or quantile, is `newest`. A negative average means
/// that there was no rollout before.
PICTURA_HD inline double filter_average(double average, float newest, double ema) {
  return average < 0 ? static_cast<double>(newest) : ema * static_cast<double>(newest) + (1 - ema) * average;
}

/// Returns the smallest |advantage| that is kept.
PICTURA_HD inline float filter_threshold(double average, double fraction) {
  return static_cast<float>(fraction * average);
}

PICTURA_HD inline bool filter_keeps(float advantage, bool is_valid, float threshold) {
  return is_valid && (advantage < 0 ? -advantage : advantage) >= threshold;
}

/// Bins in which |advantages| are counted for a quantile. The upper half of a number's bits is its bin, so there are
/// 128 bins of equal width between powers of two. The last bin counts values that are not finite. Counts are integers,
/// so ranks sum them exactly.
constexpr int kNotFiniteBin = 0x7f80;
constexpr int kNumFilterBins = kNotFiniteBin + 1;

PICTURA_HD inline int filter_bin(float advantage) {
  const auto bin = static_cast<int>((bits_from_float(advantage) & 0x7fffffffu) >> 16);
  return bin < kNotFiniteBin ? bin : kNotFiniteBin;
}

/// Returns the smallest |advantage| of a bin.
inline float filter_bin_begin(int bin) { return __builtin_bit_cast(float, static_cast<uint32_t>(bin) << 16); }

/// Returns a quantile of the |advantages| that were counted in finite bins: `share` of them are below it. Assumes that
/// values are spread evenly over each bin. Returns 0 without values.
inline float filter_quantile(Span<const int64_t> counts, double share) {
  int64_t all = 0;
  for (int bin = 0; bin < kNotFiniteBin; ++bin) all += counts[bin];
  const double wanted = share * static_cast<double>(all);
  double below = 0;
  for (int bin = 0; bin < kNotFiniteBin; ++bin) {
    const auto count = static_cast<double>(counts[bin]);
    if (below + count > wanted) {
      const double begin = static_cast<double>(filter_bin_begin(bin)),
                   width = static_cast<double>(filter_bin_begin(bin + 1)) - begin;
      return static_cast<float>(begin + (wanted - below) / count * width);
    }
    below += count;
  }
  return 0;
}

}  // namespace pictura
