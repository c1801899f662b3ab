// Samples of a pixel as people write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/renderer.h"

namespace pictura {

/// What parse_pixel_samples takes, for messages.
constexpr const char* kPixelSamplesExpected = "1 to 64 samples like 4, or a square grid of them like 4x4";

/// "4" (MSAA) or "4x4" (supersampling), both up to 64; nothing for any other text.
std::optional<PixelSamples> parse_pixel_samples(std::string_view text);

/// The text that reads back to it.
std::string text_of(const PixelSamples& samples);

}  // namespace pictura
