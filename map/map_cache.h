// Cache of imported maps: a RoadMap as a binary file. The header identifies the sources; stale or damaged files are
// rejected.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Inputs that determine a map. Equal keys mean equal maps.
struct MapCacheKey {
  uint64_t importer = 0;  // hash of the importer's sources and of the compiler version
  uint64_t source = 0;    // hash of the file's bytes
  uint64_t options = 0;   // hash of the options
};

/// Returns the key of a file with these bytes, for this build of the importer.
MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options);

/// Encodes a map: a header of magic, version, byte order, key, size and hash of the payload; then every field of
/// RoadMap in the order of map_fields.h, with strings and vectors preceded by their 64-bit size.
std::string encode_map(const RoadMap& map, const MapCacheKey& key);

/// Decodes and validates a map. Throws Error "NAME: reason" when the bytes are foreign (magic), of another byte order
/// or version, truncated, stale (another importer, file or options), or damaged (hash, sizes, values). For any bytes,
/// memory is bounded by a few times their size.
RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name);

/// Returns the header that encode_map() puts before `payload`.
std::string map_cache_header(std::string_view payload, const MapCacheKey& key);

/// Returns the path of the cache file for `source_path` imported with these options. Empty when caching is off.
std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options);

}  // namespace pictura
