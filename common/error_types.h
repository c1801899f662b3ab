// The errors of the library. Messages say where (file, line, element), what was expected and what came. Nothing in the
// library prints or exits; the command turns an Error into one `error: ...` line and an exit status.
#pragma once

#include <stdexcept>

namespace pictura {

/// The work failed: bad input, a missing file, a full disk.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller asked for something that cannot be asked for; the command exits with 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The user pressed ^C, or the process was told to end; what was finished is saved, and the command exits with 128 +
/// the signal's number.
class Interrupted : public Error {
 public:
  using Error::Error;
};

}  // namespace pictura
