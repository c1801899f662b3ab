// Error types of the library. A message names the place (file, line, element), the expected value and the actual value.
// The library never prints or exits; the command-line program turns an Error into one `error: ...` line and an exit
// status.
#pragma once

#include <stdexcept>

namespace pictura {

/// Failure of requested work, for example bad input, a missing file or a full disk.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An invalid request by the caller; the command-line program exits with status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Interruption by ^C or by a termination signal. Finished work is saved, and the command-line program exits with 128 +
/// the signal's number.
class Interrupted : public Error {
 public:
  using Error::Error;
};

}  // namespace pictura
