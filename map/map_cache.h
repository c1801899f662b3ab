// A RoadMap as a binary file, so that a map file is imported only once. The header identifies the sources; a stale or
// damaged file is rejected.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Everything that determines a map. Equal keys mean equal maps.
struct MapCacheKey {
  uint64_t importer = 0;  // hash of the importer's sources and of the compiler version
  uint64_t source = 0;    // hash of the file's bytes
  uint64_t options = 0;   // hash of the options
};

/// The key of a file with these bytes, for this build of the importer.
MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options);

/// The encoded map: a header of magic, version, byte order, key, size and hash of the payload; then every field of
/// RoadMap in the order of map_fields.h, strings and vectors preceded by their 64-bit size.
std::string encode_map(const RoadMap& map, const MapCacheKey& key);

/// The map in `bytes`, validated. Throws Error "NAME: reason" when they are foreign (magic), of another byte order or
/// version, truncated, stale (made by another importer, from another file, with other options), or damaged (hash,
/// sizes, values). Memory is bounded by a few times their size whatever they contain.
RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name);

/// The header that encode_map() puts before `payload`.
std::string map_cache_header(std::string_view payload, const MapCacheKey& key);

/// The cache file for `source_path` imported with these options. Empty when caching is off.
std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options);

}  // namespace pictura
