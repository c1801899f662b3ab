// Checked access to XML elements. Functions throw Error, which names element, line and owner, for missing, malformed or
// out-of-range attributes. Some faults are repaired instead.
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

/// An XML element and the name of its owner ("road 12"). All constructor arguments must outlive the Element.
class Element {
 public:
  Element(pugi::xml_node node, const Source* source, Faults* faults, const std::string* owner)
      : node_(node), source_(source), faults_(faults), owner_(owner) {}

  SourceLocation where() const;
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    where().fail_with(fmt::format(format, std::forward<Args>(args)...));
  }
  /// See Faults::record_repair().
  template <typename... Args>
  void record_repair(RepairKind kind, fmt::format_string<Args...> format, Args&&... args) const {
    where().record_repair(faults_, kind, format, std::forward<Args>(args)...);
  }

  explicit operator bool() const { return static_cast<bool>(node_); }
  Element child(const char* name) const { return {node_.child(name), source_, faults_, owner_}; }
  Element required_child(const char* name) const;
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

  /// Whether the attribute exists and is not empty.
  bool has(const char* attribute) const;
  std::string text(const char* attribute) const;
  std::string text(const char* attribute, const char* fallback) const;
  /// Reads a finite number.
  double number(const char* attribute) const;
  double number(const char* attribute, double fallback) const { return has(attribute) ? number(attribute) : fallback; }
  /// Returns nothing if the attribute is missing or not a finite number.
  std::optional<double> finite_number(const char* attribute) const;
  double number_in(const char* attribute, double low, double high) const;
  double number_in(const char* attribute, double low, double high, double fallback) const {
    return has(attribute) ? number_in(attribute, low, high) : fallback;
  }
  /// Repair: a missing attribute counts as 0.
  double number_or_zero(const char* attribute) const;
  double number_or_zero_in(const char* attribute, double low, double high) const;
  /// Reads a size in [0, high]. Returns 0 for a missing size. Repair: a negative size counts as missing.
  double size(const char* attribute, double high) const;
  int integer(const char* attribute) const;
  /// A missing flag is false. Repair: a value other than true, false, 1 and 0 counts as false.
  bool flag(const char* attribute) const;

  /// Returns the text between the element's tags.
  std::string content() const { return node_.text().as_string(); }

 private:
  /// Like has(), but records the repair of a missing attribute.
  bool has_or_zero(const char* attribute) const;

  pugi::xml_node node_;
  const Source* source_;
  Faults* faults_;
  const std::string* owner_;
};

// Maximum difference of stations that count as equal.
inline constexpr double kStationTolerance_m = 1e-3;

/// Reads the station from which a record applies, which should be in [0, length]. Repairs: a record before the start
/// applies from the start. Returns nullopt for a record beyond the end. A missing attribute counts as
/// `fallback`, if given.
std::optional<double> read_station(const Element& record, const char* attribute, double length,
                                   std::optional<double> fallback = std::nullopt);

/// Appends a record. Records a fault if the previous record begins later; the caller must then call sort_records().
template <typename Record>
void append_record(const Element& element, const char* attribute, double Record::* station, Record record,
                   std::vector<Record>* records) {
  if (!records->empty() && record.*station < records->back().*station) {
    element.record_repair(RepairKind::record_order, "attribute {}: expected at least the previous one's {}, got {}",
                          attribute, records->back().*station, record.*station);
  }
  records->push_back(std::move(record));
}

/// Sorts records by station. Records at equal stations keep their order, because the last of them applies.
template <typename Record>
void sort_records(double Record::* station, std::vector<Record>* records) {
  std::stable_sort(records->begin(), records->end(),
                   [station](const Record& a, const Record& b) { return a.*station < b.*station; });
}

Cubic read_cubic(const Element& element, double s);

/// Reads the cubics in the children `name`, sorted by station. The attribute named `station` must be in [0, length].
Profile read_profile(const Element& parent, const char* name, const char* station, double length);

}  // namespace pictura::opendrive
