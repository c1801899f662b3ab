// What an error says, for tests that look at messages.
#pragma once

#include <string>
#include <utility>

#include "pictura/common/error.h"

namespace pictura::test {

/// What message_of() returns where nothing is thrown.
constexpr const char* kNoError = "no error";

/// The message of the error of that type that `work` throws.
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
