// Functions that throw errors with a formatted message. Headers whose comments merely name Error include error_types.h,
// which needs no fmt.
#pragma once

#include <utility>

#include <fmt/format.h>

#include "pictura/common/error_types.h"

namespace pictura {

template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
  throw Error(fmt::format(format, std::forward<Args>(args)...));
}

template <typename... Args>
[[noreturn]] void fail_usage(fmt::format_string<Args...> format, Args&&... args) {
  throw UsageError(fmt::format(format, std::forward<Args>(args)...));
}

/// Checks an argument of a public function: throws Error with the formatted message unless `condition` holds.
#define PICTURA_CHECK(condition, ...)               \
  do {                                              \
    if (!(condition)) ::pictura::fail(__VA_ARGS__); \
  } while (0)

}  // namespace pictura
