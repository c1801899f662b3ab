// Binary files of scenes, for the cache of imported scenes and for scene_file.h.
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

/// Inputs that, with the importers, determine a scene.
struct SceneCacheKey {
  static constexpr int64_t kIndex = -2;
  // Hash of the scene's bytes or, if `record` is kIndex, of the records' lengths and checksums.
  uint64_t content = 0;
  // Index of the record in a TFRecord file; -1 for a file that holds one scene; kIndex for a file's list of records.
  int64_t record = 0;
};

struct FieldFileKind {
  std::array<char, 8> magic{};
  uint32_t version = 1;    // version of the header
  uint64_t layout = 0;     // hash of append_layout()'s text (native files) or of the importers' source code (cache)
  const char* other = "";  // message about a file of another layout
};

/// Returns a header, then the bytes that put() writes. The header contains magic bytes, version, byte order, layout,
/// key, size and CRC-32C checksum.
std::string encode_fields(const FieldFileKind& kind, const SceneCacheKey& key,
                          const std::function<void(FieldWriter*)>& put);

/// Decodes bytes by get(), which must read the whole payload. Throws Error "NAME: reason" for foreign, truncated, stale
/// or damaged bytes.
void decode_fields(std::string_view bytes, const FieldFileKind& kind, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

/// Variants for files of the cache, which are stale after the importers have changed.
std::string encode_cached(const SceneCacheKey& key, const std::function<void(FieldWriter*)>& put);

void decode_cached(std::string_view bytes, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get);

std::string encode_scenario(const Scenario& scenario, const SceneCacheKey& key);

/// Decodes and validates. Throws as decode_cached() does. Uses memory of at most a few times the size of the bytes.
Scenario decode_scenario(std::string_view bytes, const SceneCacheKey& key, const std::string& name);

}  // namespace pictura
