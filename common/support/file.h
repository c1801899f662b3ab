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

/// Returns the bytes of a file. Throws Error for a folder, for a file above max_bytes, and for a file whose size or
/// modification time changes during reading; the message names the path and the reason. Throws Interrupted if a signal
/// ends the wait for a FIFO's writer. `check` receives the first kPrefix_bytes (fewer for a shorter file) before more
/// is read, and may throw.
std::string read_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30,
                      const std::function<void(std::string_view first)>& check = {});

/// Returns the Hash64 of a file's bytes as 16 hexadecimal digits. Reads the file in pieces. Throws as read_file() does.
std::string hash_of_file(const std::string& path);

/// Writes a file through OutputFile (output_file.h): either all bytes, or nothing.
void write_file(const std::string& path, std::string_view bytes);

/// Returns the folder for files that can be computed again: $XDG_CACHE_HOME/pictura/NAME, or ~/.cache/pictura/NAME.
/// Empty if neither XDG_CACHE_HOME nor HOME is set, or if PICTURA_CACHE is `off`.
std::string cache_folder(const std::string& name);

/// Returns the bytes of a file of a cache folder, or nothing if the file does not exist. Throws as read_file() does.
/// Also throws Error for FIFOs and devices, because they might never end.
std::optional<std::string> read_cached(const std::string& path);

/// Writes a file of a cache folder, creating the folder. Failures are silent, because the user may be unable to change
/// the permissions of the cache folder.
void write_to_cache(const std::string& path, std::string_view bytes);

/// Creates the folder and its parents. Throws Error naming the folder unless it then exists and is writable.
void make_output_folder(const std::string& path);

}  // namespace pictura
