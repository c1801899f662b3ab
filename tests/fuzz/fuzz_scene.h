// What the fuzz targets of recorded scenes do with bytes, shared with tests that run it on changed fixtures.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pictura::test {

/// Reads bytes as a scene of a file with that name; the bytes of "payload" are one WOMD record without its checksums.
/// An accepted scene is compared with what its cache restores, drawn, and its traffic tested against its edges. Returns
/// whether it was accepted; anything but an Error is a fault of ours.
bool fuzz_scene(std::string_view bytes, const std::string& name);

/// Any bytes as a cached scene: 'e' and triples of a position (16 bits) and a byte edit a sound one and mend its
/// header's checksum, 'r' and bytes are read as they are.
bool fuzz_scene_cache(std::string_view bytes);

/// Small scenes of our own in every format, by file name, to begin with.
std::map<std::string, std::string> scene_seeds();

}  // namespace pictura::test
