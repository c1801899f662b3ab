// Functions that throw errors with formatted messages. Headers without fmt include error_types.h instead.
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

/// Throws Error with the formatted message unless `condition` holds.
#define PICTURA_CHECK(condition, ...)               \
  do {                                              \
    if (!(condition)) ::pictura::fail(__VA_ARGS__); \
  } while (0)

}  // namespace pictura
