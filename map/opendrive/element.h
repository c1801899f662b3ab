// Elements of the XML tree, read with checks: an attribute that is missing, malformed or out of range is an error that
// names the element, its line and its owner; one that has a sensible meaning all the same is mended.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pugixml.hpp>

#include "pictura/common/error.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// An XML element with the name of its owner ("road 12"). Refers to the document, the source, the faults and the
/// owner's name, which must outlive it.
class Element {
 public:
  Element(pugi::xml_node node, const Source* source, Faults* faults, const std::string* owner)
      : node_(node), source_(source), faults_(faults), owner_(owner) {}

  SourceLocation where() const;
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    where().fail_with(fmt::format(format, std::forward<Args>(args)...));
  }
  /// Notes a fault that the caller mends as action_of(kind) says; strict reading throws it.
  template <typename... Args>
  void mend(MendKind kind, fmt::format_string<Args...> format, Args&&... args) const {
    where().mend(faults_, kind, format, std::forward<Args>(args)...);
  }

  explicit operator bool() const { return static_cast<bool>(node_); }
  Element child(const char* name) const { return {node_.child(name), source_, faults_, owner_}; }
  Element required_child(const char* name) const;
  /// Calls visit(Element) for every child with that name.
  template <typename Visit>
  void each(const char* name, Visit&& visit) const {
    for (const pugi::xml_node node : node_.children(name)) visit(Element(node, source_, faults_, owner_));
  }
  template <typename Visit>
  void each_child(Visit&& visit) const {
    for (const pugi::xml_node node : node_.children()) {
      if (node.type() == pugi::node_element) visit(Element(node, source_, faults_, owner_));
    }
  }
  std::string_view name() const { return node_.name(); }
  Element with_owner(const std::string* owner) const { return {node_, source_, faults_, owner}; }

  /// Whether the attribute is there and has a value: some writers leave those empty that they do not set.
  bool has(const char* attribute) const;
  std::string text(const char* attribute) const;
  std::string text(const char* attribute, const char* fallback) const;
  /// A finite number.
  double number(const char* attribute) const;
  double number(const char* attribute, double fallback) const { return has(attribute) ? number(attribute) : fallback; }
  /// Nothing if it is missing or no finite number.
  std::optional<double> finite_number(const char* attribute) const;
  double number_in(const char* attribute, double low, double high) const;
  double number_in(const char* attribute, double low, double high, double fallback) const {
    return has(attribute) ? number_in(attribute, low, high) : fallback;
  }
  /// The same, where a missing attribute is mended: it counts as 0.
  double number_or_zero(const char* attribute) const;
  double number_or_zero_in(const char* attribute, double low, double high) const;
  /// A size in [0, high]; 0, for which the default counts, where it is missing. Mended: one below zero counts as
  /// missing, since some writers set -1.
  double size(const char* attribute, double high) const;
  int integer(const char* attribute) const;
  /// False where it is missing. Mended: what is neither true nor false counts as false.
  bool flag(const char* attribute) const;

  /// The text between the element's tags.
  std::string content() const { return node_.text().as_string(); }

 private:
  /// Whether the attribute is there; if not, that is mended.
  bool has_or_zero(const char* attribute) const;

  pugi::xml_node node_;
  const Source* source_;
  Faults* faults_;
  const std::string* owner_;
};

// Stations that differ by less count as equal.
inline constexpr double kStationTolerance_m = 1e-3;

/// The station in `attribute` of a record that applies from there on, within [0, length]. Mended: a record before the
/// start, which applies from the start, and one beyond the end, for which there is no station: it is left out. A
/// missing attribute counts as `fallback`, if there is one.
std::optional<double> read_station(const Element& record, const char* attribute, double length,
                                   std::optional<double> fallback = std::nullopt);

/// Appends the record of `element`. One that begins before the last one is mended by sort_records(), after all are
/// read.
template <typename Record>
void append_record(const Element& element, const char* attribute, double Record::* station, Record record,
                   std::vector<Record>* records) {
  if (!records->empty() && record.*station < records->back().*station) {
    element.mend(MendKind::record_order, "attribute {}: expected at least the previous one's {}, got {}", attribute,
                 records->back().*station, record.*station);
  }
  records->push_back(std::move(record));
}

/// Of records at one station the last one counts, as in the file.
template <typename Record>
void sort_records(double Record::* station, std::vector<Record>* records) {
  std::stable_sort(records->begin(), records->end(),
                   [station](const Record& a, const Record& b) { return a.*station < b.*station; });
}

/// The coefficients of a cubic that begins at s.
Cubic read_cubic(const Element& element, double s);

/// The cubics in the children `name` of `parent`, whose stations (the attribute named `station`) lie within
/// [0, length], sorted.
Profile read_profile(const Element& parent, const char* name, const char* station, double length);

}  // namespace pictura::opendrive
