// Functions that the fuzz targets of maps and the corpus test call.
#pragma once

#include <cstdint>
#include <string_view>

namespace pictura::test {

/// Imports the bytes as an OpenDRIVE file, both strictly and with repairs. Then makes the map's geometry, and writes
/// and reads the map through the cache. Returns whether the strict importer made a map; it may throw Error instead.
/// Other exceptions propagate. If the cache does not restore the map exactly, the process aborts.
bool fuzz_opendrive(std::string_view bytes);

/// Reads bytes as a Lanelet2 file. Returns whether they are a map.
bool fuzz_lanelet2(std::string_view bytes);

/// Reads a cached map. The first byte selects the kind of the remaining bytes. `f`: a whole file. `p`: a payload, to
/// which a matching header is added. `e`: edits of a valid payload, of five bytes each (a position and a value).
/// Returns whether they are a map.
bool fuzz_map_cache(std::string_view bytes);

}  // namespace pictura::test
