// The functions behind the fuzz targets; the corpus test uses them too.
#pragma once

#include <cstdint>
#include <string_view>

namespace pictura::test {

/// Imports the bytes as an OpenDRIVE file, strictly and with repairs, and exercises the result: its geometry and a
/// round trip through the cache. Returns whether the strict importer made a map; Error is an accepted outcome. Other
/// exceptions propagate, and a map that the cache does not restore exactly aborts.
bool fuzz_opendrive(std::string_view bytes);

/// Reads bytes as a Lanelet2 file. Returns whether it is a map.
bool fuzz_lanelet2(std::string_view bytes);

/// Reads a cached map. The first byte selects the kind of the rest: `f` a whole file, `p` a payload that gets a
/// matching header, `e` edits of five bytes each (a position and a value) of a valid payload. Returns whether it is a
/// map.
bool fuzz_map_cache(std::string_view bytes);

}  // namespace pictura::test
