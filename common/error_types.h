// Error types of the library, which never prints or exits. A message names the place (file, line, element), the
// expected value and the actual value.
#pragma once

#include <stdexcept>

namespace pictura {

/// Failure of requested work, for example because of bad input or a full disk.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Invalid request by the caller. The command-line program exits with status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Interruption by ^C or a termination signal. Finished work is saved, and the command-line program exits with 128 +
/// the signal's number.
class Interrupted : public Error {
 public:
  using Error::Error;
};

}  // namespace pictura
