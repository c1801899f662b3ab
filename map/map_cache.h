// Cache of imported maps. Each binary file holds one RoadMap, and a header that identifies the map's sources. Stale or
// damaged files are rejected.
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

/// Encodes a map as a header and a payload. The header contains the file type's magic bytes, the version, the byte
/// order, the key, and the size and hash of the payload. The payload contains every field of RoadMap in the order of
/// map_fields.h. A 64-bit size precedes each string and vector.
std::string encode_map(const RoadMap& map, const MapCacheKey& key);

/// Decodes and validates a map. Throws Error "NAME: reason" if the bytes are of another file type, byte order or
/// version, or are truncated, stale (another importer, file or options) or damaged (wrong hash, size or value). Uses
/// memory of at most a few times the size of the bytes, even if they are damaged.
RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name);

/// Returns the header that encode_map() puts before `payload`.
std::string map_cache_header(std::string_view payload, const MapCacheKey& key);

/// Returns the path of the cache file for the map file `source_path` and these options. Returns an empty path if the
/// cache is disabled.
std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options);

}  // namespace pictura
