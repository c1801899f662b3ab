// Advantage filter (paper, appendix, optimization; after Gigaflow): drops transitions with a small |advantage|. The
// threshold is a fraction of the largest |advantage|, or a quantile of |advantages|, averaged over rollouts.
#pragma once

#include <algorithm>
#include <cstdint>

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/span.h"

namespace pictura {

/// Returns the exponential average after a rollout with the value `newest`. average < 0: no rollout before.
PICTURA_HD inline double filter_average(double average, float newest, double ema) {
  return average < 0 ? static_cast<double>(newest) : ema * static_cast<double>(newest) + (1 - ema) * average;
}

PICTURA_HD inline float filter_threshold(double average, double fraction) {
  return static_cast<float>(fraction * average);
}

PICTURA_HD inline bool filter_keeps(float advantage, bool is_valid, float threshold) {
  return is_valid && (advantage < 0 ? -advantage : advantage) >= threshold;
}

/// Bins for counting |advantages|. A bin's index is the upper 16 bits of an |advantage|, so 128 equal bins lie between
/// consecutive powers of two. The last bin counts values that are not finite. Integer counts let ranks sum exactly.
constexpr int kNotFiniteBin = 0x7f80;
constexpr int kNumFilterBins = kNotFiniteBin + 1;

PICTURA_HD inline int filter_bin(float advantage) {
  const auto bin = static_cast<int>((bits_from_float(advantage) & 0x7fffffffu) >> 16);
  return bin < kNotFiniteBin ? bin : kNotFiniteBin;
}

/// Lower limit of a bin.
inline float filter_bin_begin(int bin) { return __builtin_bit_cast(float, static_cast<uint32_t>(bin) << 16); }

/// Returns a quantile of the |advantages| in finite bins: `share` of them are below it. Interpolates linearly in a bin;
/// 0 without values.
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
