#include "pictura/map/map_cache.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/map/field_codec.h"
#include "pictura/map/map_fields.h"
#include "pictura/map_fingerprint.h"

namespace pictura {

namespace {

constexpr std::array<char, 8> kMagic{'P', 'I', 'C', 'T', 'R', 'M', 'A', 'P'};
constexpr uint32_t kVersion = 1;  // version of the header; the importer's hash covers the payload's format

struct MapCacheHeader {
  std::array<char, 8> magic = kMagic;
  uint32_t version = kVersion, byte_order = kByteOrder;
  MapCacheKey key;
  uint64_t payload_bytes = 0, payload_hash = 0;
};
static_assert(std::has_unique_object_representations_v<MapCacheHeader>, "the header must have no padding");

static_assert(is_plain<LanePoint>() && is_plain<RoadEdge>() && !is_plain<Lane>() && !is_plain<Sign>());

/// Checks the header and returns the payload.
std::string_view checked_payload(std::string_view bytes, const MapCacheKey& key) {
  MapCacheHeader header;
  const std::size_t magic_bytes = std::min(bytes.size(), kMagic.size());
  PICTURA_CHECK(bytes.substr(0, magic_bytes) == std::string_view(kMagic.data(), magic_bytes),
                "foreign: expected it to begin with {}", std::string_view(kMagic.data(), kMagic.size()));
  PICTURA_CHECK(bytes.size() >= sizeof header, "truncated: {} bytes, expected at least {} for the header", bytes.size(),
                sizeof header);
  std::memcpy(&header, bytes.data(), sizeof header);
  PICTURA_CHECK(header.byte_order == kByteOrder, "written on a machine with a different byte order");
  PICTURA_CHECK(header.version == kVersion, "expected version {}, got {}", kVersion, header.version);
  PICTURA_CHECK(header.key.importer == key.importer, "stale: written by a different version of the importer");
  PICTURA_CHECK(header.key.source == key.source, "stale: the map file has changed");
  PICTURA_CHECK(header.key.options == key.options, "stale: written with different options");
  const std::string_view payload = bytes.substr(sizeof header);
  PICTURA_CHECK(header.payload_bytes <= payload.size(), "truncated: expected {} bytes after the header, got {}",
                header.payload_bytes, payload.size());
  PICTURA_CHECK(header.payload_bytes == payload.size(), "damaged: expected {} bytes after the header, got {}",
                header.payload_bytes, payload.size());
  PICTURA_CHECK(header.payload_hash == hash_of(payload), "damaged: its bytes do not match the hash in its header");
  return payload;
}

}  // namespace

MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options) {
  std::string option_bytes;
  FieldWriter(&option_bytes).put(options);
  return {.importer = PICTURA_MAP_FINGERPRINT, .source = hash_of(source_bytes), .options = hash_of(option_bytes)};
}

std::string map_cache_header(std::string_view payload, const MapCacheKey& key) {
  const MapCacheHeader header{.key = key, .payload_bytes = payload.size(), .payload_hash = hash_of(payload)};
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

std::string encode_map(const RoadMap& map, const MapCacheKey& key) {
  std::string payload;
  FieldWriter(&payload).put(map);
  return map_cache_header(payload, key) + payload;
}

RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name) {
  try {
    FieldReader reader(checked_payload(bytes, key));
    RoadMap map;
    reader.get(&map);
    reader.expect_end();
    validate(map);
    return map;
  } catch (const Error& error) {
    fail("{}: {}", name, error.what());
  }
}

std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options) {
  const std::string folder = cache_folder("maps");
  if (folder.empty()) return "";
  std::error_code error;
  const std::filesystem::path source = std::filesystem::weakly_canonical(source_path, error);
  const uint64_t path_hash = hash_of(source.string() + fmt::format(" {:x}", map_cache_key("", options).options));
  return fmt::format("{}/{}-{:016x}.map", folder, source.stem().string(), path_hash);
}

}  // namespace pictura
