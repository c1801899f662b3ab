// A RoadMap as bytes on disk, so that a file is imported once: what it was made from stands in its header, and a file
// that was made from anything else, or was damaged, is refused.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// What a map is a function of. Equal keys mean equal maps.
struct MapCacheKey {
  uint64_t importer = 0;  // hash of the sources that the importer is compiled from, and of the compiler's version
  uint64_t source = 0;    // hash of the bytes of the file
  uint64_t options = 0;   // hash of the options
};

/// The key of a file with these bytes, for this build of the importer.
MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options);

/// The map and its key: a header of magic, version, byte order, key, size and hash of the rest; then every field of
/// RoadMap in the order of map_fields.h, each string and vector behind its 64-bit size.
std::string encode_map(const RoadMap& map, const MapCacheKey& key);

/// The map in `bytes`, validated. Throws Error "NAME: reason" when they are foreign (magic), of another byte order or
/// version, truncated, stale (made by another importer, from another file, with other options), or damaged (hash,
/// sizes, values). Whatever they say, no more memory is taken than a few times their size.
RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name);

/// The header that encode_map() puts before `payload`.
std::string map_cache_header(std::string_view payload, const MapCacheKey& key);

/// The file that keeps the map of `source_path` imported with these options. Empty when maps are not kept.
std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options);

}  // namespace pictura
