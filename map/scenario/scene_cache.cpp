#include "pictura/map/scenario/scene_cache.h"

#include <array>
#include <cstring>
#include <type_traits>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"
#include "pictura/map/scenario/scenario_fields.h"
#include "pictura/map_fingerprint.h"

namespace pictura {

namespace {

constexpr FieldFileKind kCached{.magic = {'P', 'I', 'C', 'T', 'R', 'S', 'C', 'N'},
                                .layout = PICTURA_MAP_FINGERPRINT,
                                .other = "stale: written by a different version of the importer"};

struct FieldFileHeader {
  std::array<char, 8> magic{};
  uint32_t version = 0, byte_order = kByteOrder;
  uint64_t layout = 0;
  uint64_t content = 0;
  int64_t record = 0;
  uint64_t payload_bytes = 0, payload_crc = 0;
};
static_assert(std::has_unique_object_representations_v<FieldFileHeader>, "the header must have no padding");
static_assert(is_plain<TrackState>() && is_plain<LanePoint>(), "copied as a whole");

}  // namespace

std::string encode_fields(const FieldFileKind& kind, const SceneCacheKey& key,
                          const std::function<void(FieldWriter*)>& put) {
  std::string bytes(sizeof(FieldFileHeader), '\0');
  FieldWriter writer(&bytes);
  put(&writer);
  const std::string_view payload = std::string_view(bytes).substr(sizeof(FieldFileHeader));
  const FieldFileHeader header{.magic = kind.magic,
                               .version = kind.version,
                               .layout = kind.layout,
                               .content = key.content,
                               .record = key.record,
                               .payload_bytes = payload.size(),
                               .payload_crc = crc32c(payload)};
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

void decode_fields(std::string_view bytes, const FieldFileKind& kind, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get) {
  try {
    FieldFileHeader header;
    PICTURA_CHECK(bytes.size() >= sizeof header, "truncated: {} bytes, expected at least {} for the header",
                  bytes.size(), sizeof header);
    std::memcpy(&header, bytes.data(), sizeof header);
    PICTURA_CHECK(header.magic == kind.magic, "foreign: expected it to begin with {}",
                  std::string_view(kind.magic.data(), kind.magic.size()));
    PICTURA_CHECK(header.byte_order == kByteOrder, "written on a machine with a different byte order");
    PICTURA_CHECK(header.version == kind.version, "expected version {}, got {}", kind.version, header.version);
    PICTURA_CHECK(header.layout == kind.layout, "{}", kind.other);
    PICTURA_CHECK(header.content == key.content && header.record == key.record,
                  "stale: the scene's file has changed, or the cache belongs to another file");
    const std::string_view payload = bytes.substr(sizeof header);
    PICTURA_CHECK(header.payload_bytes == payload.size(), "{}: expected {} bytes after the header, got {}",
                  header.payload_bytes > payload.size() ? "truncated" : "damaged", header.payload_bytes,
                  payload.size());
    PICTURA_CHECK(header.payload_crc == crc32c(payload), "damaged: its bytes do not match the checksum in its header");
    FieldReader reader(payload);
    get(&reader);
    reader.expect_end();
  } catch (const Error& error) {
    fail("{}: {}", name, error.what());
  }
}

std::string encode_cached(const SceneCacheKey& key, const std::function<void(FieldWriter*)>& put) {
  return encode_fields(kCached, key, put);
}

void decode_cached(std::string_view bytes, const SceneCacheKey& key, const std::string& name,
                   const std::function<void(FieldReader*)>& get) {
  decode_fields(bytes, kCached, key, name, get);
}

std::string encode_scenario(const Scenario& scenario, const SceneCacheKey& key) {
  return encode_cached(key, [&](FieldWriter* writer) { writer->put(scenario); });
}

Scenario decode_scenario(std::string_view bytes, const SceneCacheKey& key, const std::string& name) {
  Scenario scenario;
  decode_cached(bytes, key, name, [&](FieldReader* reader) {
    reader->get(&scenario);
    validate(scenario);
  });
  return scenario;
}

}  // namespace pictura
