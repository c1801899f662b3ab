// Functions of the fuzz targets of maps.
#pragma once

#include <cstdint>
#include <string_view>

namespace pictura::test {

/// Imports the bytes as an OpenDRIVE file, strictly and with repairs, makes the geometry, and passes the map through
/// the cache. Returns whether the strict importer made a map; it may throw Error. The process aborts if the cache does
/// not restore the map exactly.
bool fuzz_opendrive(std::string_view bytes);

/// Returns whether the bytes are a Lanelet2 map.
bool fuzz_lanelet2(std::string_view bytes);

/// Returns whether the bytes are a cached map. First byte `f`: the others are a whole file. `p`: a payload without its
/// header. `e`: edits of a valid payload, of five bytes each (a position and a value).
bool fuzz_map_cache(std::string_view bytes);

}  // namespace pictura::test
