#include "pictura/drawing/ticks.h"

#include <algorithm>
#include <cmath>

namespace pictura {

std::vector<double> round_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(high > low) || wanted < 1 || !std::isfinite(high - low)) return ticks;
  const double raw = (high - low) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double ratio = raw / power;
  const double step = power * (ratio < 1.5 ? 1 : (ratio < 3.5 ? 2 : (ratio < 7.5 ? 5 : 10)));
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  // The loop counts with an integer, because adding 1 to a double as large as `first` may have no effect.
  const auto count = static_cast<int>(std::min(last - first + 1, 4.0 * wanted));
  for (int i = 0; i < count; ++i) ticks.push_back((first + i) * step);
  return ticks;
}

int tick_decimals(double step) { return std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6); }

}  // namespace pictura
