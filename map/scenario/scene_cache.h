// Scenes as binary files: a header that identifies the importers and the source, then every field. Stale or damaged
// files are rejected. Used for cached imports and for the files of scene_file.h.
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

/// Inputs that determine a scene, besides this build of the importers. Equal keys mean equal scenes.
struct SceneCacheKey {
  static constexpr int64_t kIndex = -2;
  uint64_t content = 0;  // hash of the scene's bytes; for an index, of the records' lengths and checksums
  int64_t record = 0;    // index in the file; -1: the file is the scene; kIndex: the list of its records
};

/// Kind of a file: the beginning of its header.
struct FieldFileKind {
  std::array<char, 8> magic{};
  uint32_t version = 1;    // version of the header
  uint64_t layout = 0;     // hash of the description of the payload's layout
  const char* other = "";  // reason in messages about a file of another layout
};

/// Encodes a header of magic, version, byte order, layout, key, size and CRC-32C, followed by the bytes that put()
/// writes.
std::string encode_fields(const FieldFileKind& kind, const SceneCacheKey& key,
                          const std::function<void(FieldWriter*)>& put);

/// Decodes bytes by get(), which must read all of the payload. Throws Error "NAME: reason" when the bytes are foreign,
/// of another byte order, version or layout, truncated, stale or damaged.
void decode_fields(std::string_view bytes, const FieldFileKind& kind, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

/// Variants for the cache's kind of file, which is stale when the importers have changed.
std::string encode_cached(const SceneCacheKey& key, const std::function<void(FieldWriter*)>& put);

void decode_cached(std::string_view bytes, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

std::string encode_scenario(const Scenario& scenario, const SceneCacheKey& key);

/// Decodes and validates a scenario. Throws as decode_cached() does. Memory is bounded by a few times the size of the
/// bytes.
Scenario decode_scenario(std::string_view bytes, const SceneCacheKey& key, const std::string& name);

}  // namespace pictura
