#include "pictura/map/opendrive/element.h"

#include <charconv>
#include <cmath>

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

SourceLocation Element::where() const { return {source_, node_.offset_debug(), owner_, node_.name()}; }

Element Element::required_child(const char* name) const {
  const Element element = child(name);
  if (!element) fail("expected a <{}> in it, found none", name);
  return element;
}

std::string Element::text(const char* attribute) const {
  const pugi::xml_attribute found = node_.attribute(attribute);
  if (!found) fail("attribute {} is missing", attribute);
  return found.value();
}

std::string Element::text(const char* attribute, const char* fallback) const {
  return node_.attribute(attribute).as_string(fallback);
}

double Element::number(const char* attribute) const {
  const std::string value = text(attribute);
  std::string_view digits = trim(value);
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double result = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(result)) {
    fail("attribute {}: expected a finite number, got '{}'", attribute, value);
  }
  return result;
}

double Element::number_in(const char* attribute, double low, double high) const {
  const double value = number(attribute);
  if (!(value >= low && value <= high)) {
    fail("attribute {}: expected a number in [{}, {}], got {}", attribute, low, high, value);
  }
  return value;
}

bool Element::flag(const char* attribute) const {
  const std::string value = text(attribute, "false");
  if (value == "true" || value == "1") return true;
  if (value == "false" || value == "0") return false;
  fail("attribute {}: expected true or false, got '{}'", attribute, value);
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

Cubic read_cubic(const Element& element, const char* station, double length) {
  return {.s = element.number_in(station, -kStationTolerance_m, length + kStationTolerance_m),
          .a = element.number("a"),
          .b = element.number("b"),
          .c = element.number("c"),
          .d = element.number("d")};
}

void append_cubic(const Element& element, const Cubic& cubic, Profile* profile) {
  if (!profile->cubics.empty() && cubic.s < profile->cubics.back().s) {
    element.fail("begins at {}; expected at least {}, where the one before it begins", cubic.s,
                 profile->cubics.back().s);
  }
  profile->cubics.push_back(cubic);
}

Profile read_profile(const Element& parent, const char* name, const char* station, double length) {
  Profile profile;
  if (!parent) return profile;
  parent.each(name,
              [&](const Element& element) { append_cubic(element, read_cubic(element, station, length), &profile); });
  return profile;
}

}  // namespace pictura::opendrive
