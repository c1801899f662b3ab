// Check that a file is regular.
#pragma once

#include <filesystem>
#include <string>

#include "pictura/common/error.h"

namespace pictura {

/// Throws Error for a FIFO, a socket or a device, which could block a reader. Accepts folders and missing files.
inline void require_regular_file(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  const bool is_other = std::filesystem::is_other(status) || std::filesystem::is_fifo(status);
  PICTURA_CHECK(!is_other, "{}: expected a regular file, got a pipe or a device", path);
}

}  // namespace pictura
