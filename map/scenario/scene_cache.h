// Scenes as binary files: a header that says what made them and of what, then every field. A stale or damaged file is
// rejected. The cache's, so that each scene is imported only once, and those of scene_file.h.
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

/// What determines a scene, besides this build of the importers. Equal keys mean equal scenes.
struct SceneCacheKey {
  static constexpr int64_t kIndex = -2;
  uint64_t content = 0;  // hash of the scene's bytes; of an index, of the records' lengths and checksums
  int64_t record = 0;    // in the file; -1: the file is the scene; kIndex: the list of its records
};

/// Which kind of file it is: what its header begins with.
struct FieldFileKind {
  std::array<char, 8> magic{};
  uint32_t version = 1;    // of the header
  uint64_t layout = 0;     // hash of what says how the payload is laid out
  const char* other = "";  // of a file of another layout
};

/// A header of magic, version, byte order, layout, key, size and CRC-32C of what put() writes; then that.
std::string encode_fields(const FieldFileKind& kind, const SceneCacheKey& key,
                          const std::function<void(FieldWriter*)>& put);

/// Reads it back by get(), which must read all of it. Throws Error "NAME: reason" when the bytes are foreign, of
/// another byte order, version or layout, truncated, stale or damaged.
void decode_fields(std::string_view bytes, const FieldFileKind& kind, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

/// The same of the kind that the cache has, whose files are stale when the importers are others.
std::string encode_cached(const SceneCacheKey& key, const std::function<void(FieldWriter*)>& put);

void decode_cached(std::string_view bytes, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

std::string encode_scenario(const Scenario& scenario, const SceneCacheKey& key);

/// The scenario, validated. Throws as decode_cached() does. Memory is bounded by a few times the bytes.
Scenario decode_scenario(std::string_view bytes, const SceneCacheKey& key, const std::string& name);

}  // namespace pictura
