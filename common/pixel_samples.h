// Parsing and formatting of PixelSamples, the number of samples per pixel.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/renderer.h"

namespace pictura {

/// The accepted input of parse_pixel_samples, for messages.
constexpr const char* kPixelSamplesExpected = "1 to 64 samples like 4, or a square grid of them like 4x4";

/// Parses "4" (MSAA) or "4x4" (supersampling), both up to 64 samples; returns nothing for any other text.
std::optional<PixelSamples> parse_pixel_samples(std::string_view text);

/// Returns the text that parse_pixel_samples() parses to these samples.
std::string text_of(const PixelSamples& samples);

}  // namespace pictura
