// Reading and writing of whole files.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"

namespace pictura {

/// Number of bytes that read_file() passes to its check.
constexpr std::size_t kPrefix_bytes = 64;

/// Returns the bytes of a file. Throws Error naming the path and the reason for folders, for files above max_bytes, and
/// for files whose size or modification time changes during reading. Throws Interrupted if a signal ends the wait for a
/// FIFO's writer. `check`, which may throw, gets the first kPrefix_bytes (fewer for a shorter file) before more is
/// read.
std::string read_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30,
                      const std::function<void(std::string_view first)>& check = {});

/// Returns the 16 digits of Hash64 over a file's bytes, reading it in pieces. Throws as read_file() does.
std::string hash_of_file(const std::string& path);

/// Writes the bytes through OutputFile (output_file.h): completely or not at all.
void write_file(const std::string& path, std::string_view bytes);

/// Folder for reproducible files: $XDG_CACHE_HOME/pictura/NAME, or ~/.cache/pictura/NAME. Empty when neither variable
/// is set, or when $PICTURA_CACHE is `off`.
std::string cache_folder(const std::string& name);

/// Returns the bytes of a file of a cache folder, or nothing if the file does not exist. Throws as read_file() does,
/// and for FIFOs and devices, which might never end.
std::optional<std::string> read_cached(const std::string& path);

/// Writes a file of a cache folder, creating the folder. Failures are silent: the user chooses the cache folder, and
/// may be unable to change its permissions.
void write_to_cache(const std::string& path, std::string_view bytes);

/// Creates the folder and its parents. Throws Error naming the folder unless it then exists and is writable.
void make_output_folder(const std::string& path);

}  // namespace pictura
