// Functions that the fuzz targets of recorded scenes call. Tests also call them, with mutated fixtures.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pictura::test {

/// Reads bytes as a scene file with this name. If the name is "payload", the bytes are one record of the Waymo Open
/// Motion Dataset (WOMD) without its checksums. If it is "fields", they are a *.scenario file in the form of
/// fuzz_scene_cache(). An accepted scene is compared with the scene that the cache restores, and is drawn, and its
/// tracks are tested against its road edges. Returns whether the scene was accepted. Any exception except Error is a
/// fault of the reader.
bool fuzz_scene(std::string_view bytes, const std::string& name);

/// Reads bytes as a cached scene. If the first byte is 'p', the others are the fields after a valid header. If it is
/// 'e', the others edit valid fields, in triples of a position (16 bits) and a new byte. Otherwise, all bytes are read
/// unchanged.
bool fuzz_scene_cache(std::string_view bytes);

/// Returns small fixture scenes in every format, by file name. Fuzzers use them as first inputs.
std::map<std::string, std::string> scene_seeds();

}  // namespace pictura::test
