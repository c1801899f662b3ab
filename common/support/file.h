// Files that are read and written whole.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"

namespace pictura {

/// How much of a file read_file() shows to its check.
constexpr std::size_t kFirst_bytes = 64;

/// The bytes of a file. Throws Error naming the path and the reason; refuses folders, files above max_bytes, and files
/// whose size or time of change differ before and after reading. Throws Interrupted while it waits for a FIFO's writer.
/// `check`, which may throw, gets the first kFirst_bytes, or what there is, before more is read.
std::string read_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30,
                      const std::function<void(std::string_view first)>& check = {});

/// The 16 digits of Hash64 over a file's bytes, of which only a piece is in memory at a time. Throws as read_file()
/// does.
std::string hash_of_file(const std::string& path);

/// Writes the bytes as OutputFile does (output_file.h): whole, or not at all.
void write_file(const std::string& path, std::string_view bytes);

/// The folder for what can be made again: $XDG_CACHE_HOME/pictura/NAME, or ~/.cache/pictura/NAME. Empty when there is
/// neither, or when $PICTURA_CACHE is `off`.
std::string cache_folder(const std::string& name);

/// The bytes of a file of a cache folder, or nothing where there is none. Throws as read_file() does, and where it is a
/// FIFO or a device, which might never end.
std::optional<std::string> read_cached(const std::string& path);

/// Writes a file of a cache folder, which is made where it is missing. Says nothing when it cannot: such a folder is
/// the user's choice, or not his to change.
void try_to_cache(const std::string& path, std::string_view bytes);

/// Makes the folder and its parents. Throws Error naming it unless it is there and can be written to afterwards.
void make_output_folder(const std::string& path);

}  // namespace pictura
