// Parser and formatter of PixelSamples.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/renderer.h"

namespace pictura {

/// Accepted texts, for messages.
constexpr const char* kPixelSamplesExpected = "1 to 64 samples, such as 4, or a square grid, such as 4x4";

/// Parses "4" (MSAA) or "4x4" (supersampling), up to 64 samples. Returns nothing for other texts.
std::optional<PixelSamples> parse_pixel_samples(std::string_view text);

/// Inverse of parse_pixel_samples().
std::string text_of(const PixelSamples& samples);

}  // namespace pictura
