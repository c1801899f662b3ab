// Files that are read whole and written under a temporary name, then renamed: a reader never sees half a file, and a
// full disk or a killed process leaves the old one.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "pictura/common/error.h"

namespace pictura {

/// The bytes of a file. Throws Error naming the path and the reason; refuses folders, files above max_bytes, and files
/// whose size or time of change differ before and after reading.
std::string read_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);

/// Calls write(temporary_path), then renames the temporary file to path. Whatever happens, no temporary file is left.
/// Throws Error naming the path and the reason.
void write_renamed(const std::string& path, const std::function<void(const std::string& temporary_path)>& write);

/// Writes the bytes under a temporary name and renames.
void write_file(const std::string& path, std::string_view bytes);

/// The folder for what can be made again: $XDG_CACHE_HOME/pictura/NAME, or ~/.cache/pictura/NAME. Empty when there is
/// neither, or when $PICTURA_CACHE is `off`.
std::string cache_folder(const std::string& name);

/// Writes a file of a cache folder, which is made where it is missing. Says nothing when it cannot: such a folder is
/// the user's choice, or not his to change.
void try_to_cache(const std::string& path, std::string_view bytes);

/// Makes the folder and its parents. Throws Error naming it unless it is there and can be written to afterwards.
void make_output_folder(const std::string& path);

}  // namespace pictura
