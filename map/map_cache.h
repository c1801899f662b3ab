// Cache of imported maps: binary files of one RoadMap each.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Inputs that determine a map.
struct MapCacheKey {
  uint64_t importer = 0;  // hash of the importer's sources and of the compiler version
  uint64_t source = 0;    // hash of the file's bytes
  uint64_t options = 0;
};

/// Returns the key for this build of the importer.
MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options);

/// Returns a header, then every field of RoadMap (field_codec.h). The header contains magic bytes, version, byte order,
/// key, and the payload's size and hash.
std::string encode_map(const RoadMap& map, const MapCacheKey& key);

/// Decodes and validates a map. Throws Error "NAME: reason" for foreign, truncated, stale or damaged bytes. Uses memory
/// of at most a few times the size of the bytes, even if they are damaged.
RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name);

/// Returns the header that encode_map() puts before `payload`.
std::string map_cache_header(std::string_view payload, const MapCacheKey& key);

/// Returns the cache file for a map file and options. Returns an empty path if the cache is disabled.
std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options);

}  // namespace pictura
