// What the fuzz targets do with their input; the corpus goes through the same functions in every test run.
#pragma once

#include <cstdint>
#include <string_view>

namespace pictura::test {

/// Imports the bytes as an OpenDRIVE file, strictly and leniently, and puts what comes out to use: its geometry, and
/// the cache there and back. Says whether the strict importer made a map; an Error is an answer too. Anything else
/// escapes, and a map that does not come back from the cache aborts.
bool fuzz_opendrive(std::string_view bytes);

/// Reads a cached map. The first byte says what the rest is: `f` a whole file, `p` what follows a header that fits it,
/// `e` edits of five bytes each (a place and a value) to such a payload that is sound. Says whether a map came out.
bool fuzz_map_cache(std::string_view bytes);

}  // namespace pictura::test
