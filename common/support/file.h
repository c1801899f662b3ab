// Reading and writing of whole files.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"

namespace pictura {

/// Maximum number of bytes that read_file() passes to `check`.
constexpr std::size_t kPrefix_bytes = 64;

/// Returns the bytes of a file. Throws Error for a folder, for a file above max_bytes, and for a file that changes
/// during reading. Throws Interrupted if a signal ends the wait for a FIFO's writer. `check` receives the first
/// kPrefix_bytes before the rest is read, and may throw.
std::string read_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30,
                      const std::function<void(std::string_view first)>& check = {});

/// Returns the Hash64 of a file's bytes in hexadecimal. Throws as read_file() does.
std::string hash_of_file(const std::string& path);

/// Writes a file completely or not at all (output_file.h).
void write_file(const std::string& path, std::string_view bytes);

/// Returns the folder for cached files: $XDG_CACHE_HOME/pictura/NAME or ~/.cache/pictura/NAME. Empty if neither
/// XDG_CACHE_HOME nor HOME is set, or if PICTURA_CACHE is `off`.
std::string cache_folder(const std::string& name);

/// Returns the bytes of a cached file, or nothing if it is missing. Throws as read_file() does, and Error for FIFOs and
/// devices.
std::optional<std::string> read_cached(const std::string& path);

/// Writes a cached file, creating its folder. Ignores failures, because the folder may be outside the user's control.
void write_to_cache(const std::string& path, std::string_view bytes);

/// Creates the folder and its parents. Throws Error unless it is then writable.
void make_output_folder(const std::string& path);

}  // namespace pictura
