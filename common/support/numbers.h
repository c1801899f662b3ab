// The one parser of numbers that people write: options of the command, overrides of a configuration, names of maps.
// Decimal alone, and whole numbers in any decimal notation: 1000, 1e3, 1000.0 and 0010 are numbers, 0x10, 1_000, nan
// and inf are none.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pictura {

/// The number that the whole text is; nothing for other text, and for what no double holds.
std::optional<double> parse_number(std::string_view text);

/// The whole number that the whole text is, exactly; nothing for other text, fractions, and what lies outside the type.
std::optional<uint64_t> parse_unsigned(std::string_view text);
std::optional<int64_t> parse_integer(std::string_view text);

/// The number that the whole text is, as programs write them, whatever the locale: nan and inf too.
std::optional<double> parse_written_number(std::string_view text);

/// Whether the text is meant as a number, though it may be none: it begins with a digit, or with a sign or a point
/// before one.
bool looks_like_number(std::string_view text);

/// A number as messages say it: without the trailing zeros and the 300 digits of a double's largest.
std::string text_of_number(double number);

}  // namespace pictura
