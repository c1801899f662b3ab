// Check that a file is regular, for code that reads a text as a whole. Opening a FIFO would wait for its writer, and ^C
// could not end the wait, because signals are polled only between steps of work.
#pragma once

#include <filesystem>
#include <string>

#include "pictura/common/error.h"

namespace pictura {

/// Throws Error naming the path if it is a FIFO, a socket or a device. Accepts folders and missing files, because
/// reading them reports an error.
inline void require_regular_file(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  const bool is_other = std::filesystem::is_other(status) || std::filesystem::is_fifo(status);
  PICTURA_CHECK(!is_other, "{}: expected a regular file, got a pipe or a device", path);
}

}  // namespace pictura
