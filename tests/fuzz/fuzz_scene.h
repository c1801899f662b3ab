// Functions of the fuzz targets of recorded scenes.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pictura::test {

/// Reads bytes as a scene file with this name. "payload": one record of the Waymo Open Motion Dataset (WOMD) without
/// checksums. "fields": a *.scenario file in the form of fuzz_scene_cache(). Caches, draws and tests an accepted scene.
/// Returns whether the scene was accepted. Any exception except Error is a fault of the reader.
bool fuzz_scene(std::string_view bytes, const std::string& name);

/// Reads bytes as a cached scene. First byte 'p': the others are the fields after a valid header. 'e': they edit valid
/// fields, in triples of a position (16 bits) and a new byte. Otherwise, all bytes are read unchanged.
bool fuzz_scene_cache(std::string_view bytes);

/// Returns scenes in every format, by file name, as first inputs of fuzzers.
std::map<std::string, std::string> scene_seeds();

}  // namespace pictura::test
