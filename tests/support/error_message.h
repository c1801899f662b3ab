// Access to error messages.
#pragma once

#include <string>
#include <utility>

#include "pictura/common/error_types.h"

namespace pictura::test {

/// Result of message_of() if nothing is thrown.
constexpr const char* kNoError = "no error";

/// Returns the message of the Expected error that `work` throws.
template <typename Expected = Error, typename Work>
std::string message_of(Work&& work) {
  try {
    std::forward<Work>(work)();
  } catch (const Expected& error) {
    return error.what();
  }
  return kNoError;
}

}  // namespace pictura::test
