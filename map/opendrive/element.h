// Elements of the XML tree, read with checks: an attribute that is missing, malformed or out of range is an error that
// names the element, its line and its owner.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <pugixml.hpp>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// An XML element with the name of its owner ("road 12"). Refers to the document and the source, which must outlive it.
class Element {
 public:
  Element(pugi::xml_node node, const Source* source, std::string owner)
      : node_(node), source_(source), owner_(std::move(owner)) {}

  SourceLocation where() const;
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    where().fail_with(fmt::format(format, std::forward<Args>(args)...));
  }

  explicit operator bool() const { return static_cast<bool>(node_); }
  Element child(const char* name) const { return {node_.child(name), source_, owner_}; }
  Element required_child(const char* name) const;
  /// Calls visit(Element) for every child with that name.
  template <typename Visit>
  void each(const char* name, Visit&& visit) const {
    for (const pugi::xml_node node : node_.children(name)) visit(Element(node, source_, owner_));
  }
  template <typename Visit>
  void each_child(Visit&& visit) const {
    for (const pugi::xml_node node : node_.children()) {
      if (node.type() == pugi::node_element) visit(Element(node, source_, owner_));
    }
  }
  std::string_view name() const { return node_.name(); }
  Element with_owner(std::string owner) const { return {node_, source_, std::move(owner)}; }

  bool has(const char* attribute) const { return static_cast<bool>(node_.attribute(attribute)); }
  std::string text(const char* attribute) const;
  std::string text(const char* attribute, const char* fallback) const;
  /// A finite number.
  double number(const char* attribute) const;
  double number(const char* attribute, double fallback) const { return has(attribute) ? number(attribute) : fallback; }
  double number_in(const char* attribute, double low, double high) const;
  double number_in(const char* attribute, double low, double high, double fallback) const {
    return has(attribute) ? number_in(attribute, low, high) : fallback;
  }
  int integer(const char* attribute) const;
  bool flag(const char* attribute) const;  // false if absent

  /// The text between the element's tags.
  std::string content() const { return node_.text().as_string(); }

 private:
  pugi::xml_node node_;
  const Source* source_;
  std::string owner_;
};

// Stations that differ by less count as equal.
inline constexpr double kStationTolerance_m = 1e-3;

/// Reads a cubic whose station (the attribute named `station`) lies within [0, length].
Cubic read_cubic(const Element& element, const char* station, double length);

/// Appends the cubic of `element`, which must not begin before the last one.
void append_cubic(const Element& element, const Cubic& cubic, Profile* profile);

/// Reads the cubics in the children `name` of `parent`, whose stations (the attribute named `station`) ascend within
/// [0, length].
Profile read_profile(const Element& parent, const char* name, const char* station, double length);

}  // namespace pictura::opendrive
