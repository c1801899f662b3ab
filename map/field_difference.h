// Bitwise comparison of structs that have a list of fields (map_fields.h).
#pragma once

#include <cstring>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "pictura/map/map_fields.h"

namespace pictura {

namespace field_difference {

template <typename T>
std::string difference(const T& a, const T& b);

template <typename T, std::size_t... I>
std::string difference_of_fields(const T& a, const T& b, std::index_sequence<I...>) {
  std::string found;
  auto compare = [&](std::size_t i, const auto& field_a, const auto& field_b) {
    const std::string inside = difference(field_a, field_b);
    if (inside.empty()) return false;
    const bool is_path = inside[0] == '[' || inside[0] == ':' || inside[0] == '.';
    found = fmt::format(".{}{}{}", field_name_at(field_names_of(a), i), is_path ? "" : ": ", inside);
    return true;
  };
  const auto fields_a = fields_of(a), fields_b = fields_of(b);
  (compare(I, std::get<I>(fields_a), std::get<I>(fields_b)) || ...);
  return found;
}

template <typename Items>
std::string difference_of_items(const Items& a, const Items& b) {
  if (a.size() != b.size()) return fmt::format(": {} and {} elements", a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (const std::string inside = difference(a[i], b[i]); !inside.empty()) {
      return fmt::format("[{}]{}{}", i, inside[0] == '.' ? "" : ": ", inside);
    }
  }
  return "";
}

template <typename T>
std::string difference(const T& a, const T& b) {
  if constexpr (std::is_enum_v<T>) {
    return a == b ? "" : fmt::format("{} and {}", to_string(a), to_string(b));
  } else if constexpr (std::is_arithmetic_v<T>) {
    return std::memcmp(&a, &b, sizeof a) == 0 ? "" : fmt::format("{} and {}", a, b);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return a == b ? "" : fmt::format("'{}' and '{}'", a, b);
  } else if constexpr (requires { fields_of(a); }) {
    return difference_of_fields(a, b, std::make_index_sequence<std::tuple_size_v<decltype(fields_of(a))>>());
  } else {
    return difference_of_items(a, b);
  }
}

}  // namespace field_difference

/// Returns the first difference as the field's path and both values, such as "lanes[3].length_m: 4 and 5", or an empty
/// string.
template <typename T>
std::string difference_of(const T& a, const T& b) {
  const std::string path = field_difference::difference(a, b);
  return path.empty() ? path : path.substr(1);
}

}  // namespace pictura
