// What the fuzz targets of recorded scenes do with bytes, shared with tests that run it on changed fixtures.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pictura::test {

/// Reads bytes as a scene of a file with that name; the bytes of "payload" are one WOMD record without its checksums,
/// those of "fields" a file *.scenario as fuzz_scene_cache() has them. An accepted scene is compared with what its
/// cache restores, drawn, and its traffic tested against its edges. Returns whether it was accepted; anything but an
/// Error is a fault of ours.
bool fuzz_scene(std::string_view bytes, const std::string& name);

/// Any bytes as a cached scene: 'p' and bytes are its fields, after a sound header; 'e' and triples of a position
/// (16 bits) and a byte edit sound ones; anything else and bytes are read as they are.
bool fuzz_scene_cache(std::string_view bytes);

/// Small scenes of our own in every format, by file name, to begin with.
std::map<std::string, std::string> scene_seeds();

}  // namespace pictura::test
