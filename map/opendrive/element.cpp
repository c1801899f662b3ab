#include "pictura/map/opendrive/element.h"

#include <charconv>
#include <cmath>
#include <limits>

#include "pictura/common/error.h"

namespace pictura::opendrive {

namespace {

constexpr int kMaxInteger = 1'000'000'000;

std::string_view trim(std::string_view text) {
  const char* const blanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace

SourceLocation Element::where() const { return {source_, node_.offset_debug(), *owner_, node_.name()}; }

Element Element::required_child(const char* name) const {
  const Element element = child(name);
  if (!element) fail("expected a <{}> inside, found none", name);
  return element;
}

std::string Element::text(const char* attribute) const {
  const pugi::xml_attribute found = node_.attribute(attribute);
  if (!found) fail("attribute {} is missing", attribute);
  return found.value();
}

std::string Element::text(const char* attribute, const char* fallback) const {
  return has(attribute) ? node_.attribute(attribute).value() : fallback;
}

bool Element::has(const char* attribute) const { return !trim(node_.attribute(attribute).value()).empty(); }

std::optional<double> Element::finite_number(const char* attribute) const {
  std::string_view digits = trim(node_.attribute(attribute).value());
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double result = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(result)) return std::nullopt;
  return result;
}

double Element::number(const char* attribute) const {
  const std::optional<double> number = finite_number(attribute);
  if (!number) fail("attribute {}: expected a finite number, got '{}'", attribute, text(attribute));
  return *number;
}

double Element::number_in(const char* attribute, double low, double high) const {
  const double value = number(attribute);
  if (!(value >= low && value <= high)) {
    fail("attribute {}: expected a number in [{}, {}], got {}", attribute, low, high, value);
  }
  return value;
}

double Element::size(const char* attribute, double high) const {
  const double value = number_in(attribute, std::numeric_limits<double>::lowest(), high, 0);
  if (value >= 0) return value;
  record_repair(RepairKind::negative_size, "attribute {}: expected a number in [0, {}], got {}", attribute, high,
                value);
  return 0;
}

bool Element::has_or_zero(const char* attribute) const {
  if (has(attribute)) return true;
  record_repair(RepairKind::missing_zero, "attribute {} is missing", attribute);
  return false;
}

double Element::number_or_zero(const char* attribute) const { return has_or_zero(attribute) ? number(attribute) : 0; }

double Element::number_or_zero_in(const char* attribute, double low, double high) const {
  return has_or_zero(attribute) ? number_in(attribute, low, high) : 0;
}

bool Element::flag(const char* attribute) const {
  const std::string value = text(attribute, "false");
  if (value == "true" || value == "1") return true;
  if (value != "false" && value != "0") {
    record_repair(RepairKind::unknown_flag, "attribute {}: expected true or false, got '{}'", attribute, value);
  }
  return false;
}

int Element::integer(const char* attribute) const {
  const std::string value = text(attribute);
  const std::string_view digits = trim(value);
  int result = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
  if (error != std::errc() || end != digits.data() + digits.size() || result < -kMaxInteger || result > kMaxInteger) {
    fail("attribute {}: expected an integer within {} of 0, got '{}'", attribute, kMaxInteger, value);
  }
  return result;
}

std::optional<double> read_station(const Element& record, const char* attribute, double length,
                                   std::optional<double> fallback) {
  const double s = fallback ? record.number(attribute, *fallback) : record.number(attribute);
  if (s >= -kStationTolerance_m && s <= length + kStationTolerance_m) return s;
  record.record_repair(s < 0 ? RepairKind::record_before_start : RepairKind::record_beyond_end,
                       "attribute {}: expected a number in [0, {}], got {}", attribute, length, s);
  if (s < 0) return s;
  return std::nullopt;
}

Cubic read_cubic(const Element& element, double s) {
  return {.s = s,
          .a = element.number_or_zero("a"),
          .b = element.number_or_zero("b"),
          .c = element.number_or_zero("c"),
          .d = element.number_or_zero("d")};
}

Profile read_profile(const Element& parent, const char* name, const char* station, double length) {
  Profile profile;
  if (!parent) return profile;
  parent.each(name, [&](const Element& element) {
    const std::optional<double> s = read_station(element, station, length);
    if (s) append_record(element, station, &Cubic::s, read_cubic(element, *s), &profile.cubics);
  });
  sort_records(&Cubic::s, &profile.cubics);
  return profile;
}

}  // namespace pictura::opendrive
