#include "pictura/cli/finite_range.h"

#include <fmt/format.h>

namespace pictura {

CLI::Validator finite_range(double low, double high) {
  auto complaint = [low, high](const std::string& text) -> std::string {
    double value = 0;
    // No comparison with NaN is true.
    if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return "";
    return fmt::format("expected a number of {} to {}, got '{}'", low, high, text);
  };
  return {complaint, fmt::format("{} to {}", low, high)};
}

}  // namespace pictura
