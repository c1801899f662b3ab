#include "pictura/common/support/numbers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace pictura {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view take_digits(std::string_view* text) {
  const auto end = std::find_if_not(text->begin(), text->end(), is_digit);
  const std::string_view digits = text->substr(0, static_cast<std::size_t>(end - text->begin()));
  text->remove_prefix(digits.size());
  return digits;
}

bool take(std::string_view* text, std::string_view any_of) {
  if (text->empty() || any_of.find(text->front()) == std::string_view::npos) return false;
  text->remove_prefix(1);
  return true;
}

// A parsed decimal number: digits * 10^exponent.
struct Decimal {
  bool negative = false;
  std::string digits;  // without leading zeros; empty for 0
  int64_t exponent = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal result;
  result.negative = text.starts_with('-');
  take(&text, "+-");
  const std::string_view whole = take_digits(&text);
  const std::string_view fraction = take(&text, ".") ? take_digits(&text) : std::string_view();
  if (whole.empty() && fraction.empty()) return std::nullopt;
  if (take(&text, "eE")) {
    const bool is_negative = text.starts_with('-');
    take(&text, "+-");
    const std::string_view exponent = take_digits(&text);
    constexpr std::size_t kMaxDigits = 6;  // no number has a larger exponent
    if (exponent.empty() || exponent.size() > kMaxDigits) return std::nullopt;
    std::from_chars(exponent.data(), exponent.data() + exponent.size(), result.exponent);
    if (is_negative) result.exponent = -result.exponent;
  }
  if (!text.empty()) return std::nullopt;
  result.digits = std::string(whole) + std::string(fraction);
  result.digits.erase(0, result.digits.find_first_not_of('0'));
  result.exponent -= static_cast<int64_t>(fraction.size());
  return result;
}

// Returns the magnitude of an integer.
std::optional<uint64_t> magnitude_of(Decimal decimal) {
  if (decimal.digits.empty()) return 0;
  for (; decimal.exponent < 0; ++decimal.exponent) {
    if (decimal.digits.empty() || decimal.digits.back() != '0') return std::nullopt;
    decimal.digits.pop_back();
  }
  if (decimal.exponent + static_cast<int64_t>(decimal.digits.size()) > std::numeric_limits<uint64_t>::digits10 + 1) {
    return std::nullopt;
  }
  decimal.digits.append(static_cast<std::size_t>(decimal.exponent), '0');
  uint64_t value = 0;
  const char* const end = decimal.digits.data() + decimal.digits.size();
  const auto parsed = std::from_chars(decimal.digits.data(), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  if (!parse_decimal(text)) return std::nullopt;
  take(&text, "+");
  double value = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  // from_chars() also reports values between 0 and the smallest double as out of range.
  if (parsed.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<uint64_t> parse_unsigned(std::string_view text) {
  const std::optional<Decimal> decimal = parse_decimal(text);
  const std::optional<uint64_t> magnitude = decimal ? magnitude_of(*decimal) : std::nullopt;
  if (!magnitude || (decimal->negative && *magnitude > 0)) return std::nullopt;
  return magnitude;
}

std::optional<int64_t> parse_integer(std::string_view text) {
  const std::optional<Decimal> decimal = parse_decimal(text);
  const std::optional<uint64_t> magnitude = decimal ? magnitude_of(*decimal) : std::nullopt;
  constexpr auto kMax = static_cast<uint64_t>(std::numeric_limits<int64_t>::max());
  if (!magnitude || *magnitude > kMax + (decimal->negative ? 1 : 0)) return std::nullopt;
  return static_cast<int64_t>(decimal->negative ? 0 - *magnitude : *magnitude);
}

std::optional<double> parse_written_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool looks_like_number(std::string_view text) {
  take(&text, "+-");
  take(&text, ".");
  return !text.empty() && is_digit(text.front());
}

std::string text_of_number(double number) { return fmt::format("{:.15g}", number); }

}  // namespace pictura
