#include "pictura/map/opendrive/element.h"

#include <charconv>
#include <cmath>
#include <cstring>

namespace pictura::opendrive {

namespace {

std::string_view trim(std::string_view text) {
  const char* const blanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// The element's name as a literal: places in the file outlive the document.
const char* element_name(const pugi::xml_node& node) {
  static constexpr const char* kNames[] = {"OpenDRIVE",
                                           "road",
                                           "link",
                                           "predecessor",
                                           "successor",
                                           "type",
                                           "speed",
                                           "planView",
                                           "geometry",
                                           "line",
                                           "arc",
                                           "spiral",
                                           "poly3",
                                           "paramPoly3",
                                           "elevation",
                                           "lanes",
                                           "laneOffset",
                                           "laneSection",
                                           "left",
                                           "center",
                                           "right",
                                           "lane",
                                           "width",
                                           "border",
                                           "roadMark",
                                           "objects",
                                           "object",
                                           "outline",
                                           "cornerRoad",
                                           "signals",
                                           "cornerLocal",
                                           "signal",
                                           "signalReference",
                                           "validity",
                                           "controller",
                                           "control",
                                           "junction",
                                           "connection",
                                           "laneLink",
                                           "superelevation",
                                           "elevationProfile",
                                           "lateralProfile",
                                           "shape"};
  for (const char* known : kNames) {
    if (std::strcmp(known, node.name()) == 0) return known;
  }
  return "element";
}

}  // namespace

Where Element::where() const { return {source_, node_.offset_debug(), owner_, element_name(node_)}; }

Element Element::needed_child(const char* name) const {
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

int Element::integer(const char* attribute) const {
  const std::string value = text(attribute);
  const std::string_view digits = trim(value);
  int result = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
  if (error != std::errc() || end != digits.data() + digits.size()) {
    fail("attribute {}: expected an integer, got '{}'", attribute, value);
  }
  return result;
}

Profile read_profile(const Element& parent, const char* name, const char* station, double length) {
  Profile profile;
  if (!parent) return profile;
  parent.each(name, [&](const Element& element) {
    Cubic cubic;
    cubic.s = element.number_in(station, -kStationTolerance_m, length + kStationTolerance_m);
    cubic.a = element.number("a");
    cubic.b = element.number("b");
    cubic.c = element.number("c");
    cubic.d = element.number("d");
    if (!profile.cubics.empty() && cubic.s < profile.cubics.back().s) {
      element.fail("attribute {}: expected at least the previous one's {}, got {}", station, profile.cubics.back().s,
                   cubic.s);
    }
    profile.cubics.push_back(cubic);
  });
  return profile;
}

}  // namespace pictura::opendrive
