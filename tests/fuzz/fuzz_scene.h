// Functions behind the fuzz targets of recorded scenes, shared with tests that run them on changed fixtures.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pictura::test {

/// Reads bytes as a scene file of that name. The bytes of "payload" are one WOMD record without its checksums, those of
/// "fields" a file *.scenario in the form of fuzz_scene_cache(). An accepted scene is compared with the scene that its
/// cache restores, and is drawn; its traffic is tested against its edges. Returns whether the scene was accepted. Any
/// exception but Error is a fault of the reader.
bool fuzz_scene(std::string_view bytes, const std::string& name);

/// Reads bytes as a cached scene: 'p' and bytes are its fields, after a valid header; 'e' and triples of a position
/// (16 bits) and a byte edit valid fields; other bytes are read as they are.
bool fuzz_scene_cache(std::string_view bytes);

/// Returns small fixture scenes in every format, by file name, as first inputs.
std::map<std::string, std::string> scene_seeds();

}  // namespace pictura::test
