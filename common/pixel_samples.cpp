#include "pictura/common/pixel_samples.h"

#include <charconv>

#include <fmt/format.h>

namespace pictura {

namespace {

std::optional<int> parse_count(std::string_view text) {
  constexpr int kMaxCount = 64;
  int count = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), count);
  if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() || count < 1 || count > kMaxCount) return {};
  return count;
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
