// Parser of all numbers that users write in options of commands, overrides of configurations and names of maps. It
// accepts only decimal numbers. Integers may have any decimal notation: 1000, 1e3, 1000.0 and 0010 are accepted; 0x10,
// 1_000, nan and inf are not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pictura {

/// Parses the whole text as a number. Returns nothing for other text and for numbers outside the range of double.
std::optional<double> parse_number(std::string_view text);

/// Parses the whole text as an integer, exactly. Returns nothing for other text, fractions, and values outside the
/// type.
std::optional<uint64_t> parse_unsigned(std::string_view text);
std::optional<int64_t> parse_integer(std::string_view text);

/// Parses the whole text as a number that a program wrote, regardless of the locale. Accepts nan and inf.
std::optional<double> parse_written_number(std::string_view text);

/// Whether a text, valid or not, is meant as a number: it begins with a digit, or with a sign or a point before a
/// digit.
bool looks_like_number(std::string_view text);

/// Formats a number for messages, without trailing zeros and without the 300 digits of the largest doubles.
std::string text_of_number(double number);

}  // namespace pictura
