// Binary files of scenes. A header identifies the importers and the source, and all fields follow. Stale or damaged
// files are rejected. The cache of imported scenes and the scene files of scene_file.h use this format.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/field_codec.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// Inputs that determine a scene. For one build of the importers, equal keys mean equal scenes.
struct SceneCacheKey {
  static constexpr int64_t kIndex = -2;
  // Hash of the scene's bytes; for a list of records (kIndex), hash of their lengths and checksums.
  uint64_t content = 0;
  // Index of the record in the file; -1 if the file is the scene, kIndex for the list of the file's records.
  int64_t record = 0;
};

/// Kind of a file. The header of the file contains magic bytes, version and layout.
struct FieldFileKind {
  std::array<char, 8> magic{};
  uint32_t version = 1;    // version of the header
  uint64_t layout = 0;     // hash of the text that describes the payload's layout
  const char* other = "";  // reason in messages about a file of another layout
};

/// Encodes a header, followed by the bytes that put() writes. The header contains magic bytes, version, byte order,
/// layout, key, size and CRC-32C checksum.
std::string encode_fields(const FieldFileKind& kind, const SceneCacheKey& key,
                          const std::function<void(FieldWriter*)>& put);

/// Decodes bytes by get(), which must read the whole payload. Throws Error "NAME: reason" if the bytes are of another
/// file type, byte order, version or layout, or are truncated, stale or damaged.
void decode_fields(std::string_view bytes, const FieldFileKind& kind, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

/// Variants of encode_fields() and decode_fields() for files of the cache. Such files are stale after the importers
/// have changed.
std::string encode_cached(const SceneCacheKey& key, const std::function<void(FieldWriter*)>& put);

void decode_cached(std::string_view bytes, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

std::string encode_scenario(const Scenario& scenario, const SceneCacheKey& key);

/// Decodes and validates a scenario. Throws as decode_cached() does. Uses memory of at most a few times the size of the
/// bytes.
Scenario decode_scenario(std::string_view bytes, const SceneCacheKey& key, const std::string& name);

}  // namespace pictura
