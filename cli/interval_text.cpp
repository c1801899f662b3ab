#include "pictura/cli/interval_text.h"

#include <cmath>

#include <fmt/format.h>

namespace pictura {

std::string interval_text(const Estimate& estimate, int decimals) {
  if (!std::isfinite(estimate.value)) return "-";
  const std::string value = fmt::format("{:.{}f} +- ", estimate.value, decimals);
  // A single scenario has no interval.
  if (!std::isfinite(estimate.half_width_95)) return value + "-";
  return value + fmt::format("{:.{}f}", estimate.half_width_95, decimals);
}

}  // namespace pictura
