// Refuses what is no regular file where a text is to be read whole: opening a FIFO waits for its writer, beyond the
// reach of signals that are only looked at between steps.
#pragma once

#include <filesystem>
#include <string>

#include "pictura/common/error.h"

namespace pictura {

/// Throws Error naming the path if it is a FIFO, a socket or a device. What is missing or a folder is left to the
/// reader.
inline void require_regular_file(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  const bool is_other = std::filesystem::is_other(status) || std::filesystem::is_fifo(status);
  PICTURA_CHECK(!is_other, "{}: expected a regular file, got a pipe or a device", path);
}

}  // namespace pictura
