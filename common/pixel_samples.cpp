#include "pictura/common/pixel_samples.h"

#include <fmt/format.h>

#include "pictura/common/support/numbers.h"

namespace pictura {

namespace {

std::optional<int> parse_count(std::string_view text) {
  constexpr uint64_t kMaxCount = 64;
  const std::optional<uint64_t> count = parse_unsigned(text);
  if (!count || *count < 1 || *count > kMaxCount) return {};
  return static_cast<int>(*count);
}

}  // namespace

std::optional<PixelSamples> parse_pixel_samples(std::string_view text) {
  const std::size_t cross = text.find('x');
  const std::optional<int> across = parse_count(text.substr(0, cross));
  if (!across) return {};
  if (cross == std::string_view::npos) return PixelSamples{.grid = 1, .multisample = *across};
  if (parse_count(text.substr(cross + 1)) != across) return {};
  return PixelSamples{.grid = *across, .multisample = 1};
}

std::string text_of(const PixelSamples& samples) {
  return samples.grid > 1 ? fmt::format("{0}x{0}", samples.grid) : fmt::format("{}", samples.multisample);
}

}  // namespace pictura
