// Faults in a record of a scene file. Readers throw the innermost field's name. Callers prefix the names of enclosing
// fields while the exception propagates.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

/// Fault of a field, which to_error() converts to an Error.
struct FieldError {
  std::string path;    // "tracks[4].states[17].center_x"; empty for the record itself
  std::string reason;  // "expected a finite number, got nan"
};

/// Returns "SOURCE: PATH: REASON".
inline Error to_error(const std::string& source, const FieldError& error) {
  return Error(error.path.empty() ? fmt::format("{}: {}", source, error.reason)
                                  : fmt::format("{}: {}: {}", source, error.path, error.reason));
}

template <typename... Args>
[[noreturn]] void fail_field(std::string_view field, fmt::format_string<Args...> format, Args&&... args) {
  throw FieldError{std::string(field), fmt::format(format, std::forward<Args>(args)...)};
}

/// Returns work(), and prefixes the paths of FieldErrors with "NAME.".
template <typename Work>
auto within(std::string_view name, Work&& work) {
  try {
    return work();
  } catch (FieldError& error) {
    const bool joins = error.path.empty() || error.path[0] == '[';
    error.path = fmt::format("{}{}{}", name, joins ? "" : ".", error.path);
    throw;
  }
}

/// Returns work(), and prefixes the paths of FieldErrors with "NAME[INDEX].".
template <typename Work>
auto within(std::string_view name, std::size_t index, Work&& work) {
  try {
    return work();
  } catch (FieldError& error) {
    const bool joins = error.path.empty() || error.path[0] == '[';
    error.path = fmt::format("{}[{}]{}{}", name, index, joins ? "" : ".", error.path);
    throw;
  }
}

/// Throws FieldError if the number is not finite or exceeds `largest` in magnitude.
inline double checked_number(std::string_view field, double value, double largest = 1e9) {
  if (!std::isfinite(value)) fail_field(field, "expected a finite number, got {}", value);
  if (std::abs(value) > largest) {
    fail_field(field, "expected a number of at most {:g} in magnitude, got {:g}", largest, value);
  }
  return value;
}

}  // namespace pictura
