// Parser of numbers that users write. It accepts decimal notation: 1000, 1e3, 1000.0 and 0010, but not 0x10, 1_000, nan
// or inf. Functions parse the whole text, and return nothing for invalid texts and numbers out of range.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pictura {

std::optional<double> parse_number(std::string_view text);

/// Parse integers exactly, in any decimal notation.
std::optional<uint64_t> parse_unsigned(std::string_view text);
std::optional<int64_t> parse_integer(std::string_view text);

/// Parses a number that a program wrote, in any locale. Accepts nan and inf.
std::optional<double> parse_written_number(std::string_view text);

/// Whether a text begins with a digit, or with a sign or a point before a digit.
bool looks_like_number(std::string_view text);

/// Formats a number for messages.
std::string text_of_number(double number);

}  // namespace pictura
