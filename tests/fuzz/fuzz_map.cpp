#include "pictura/tests/fuzz/fuzz_map.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "pictura/common/error.h"
#include "pictura/map/lanelet2/lanelet2.h"
#include "pictura/map/map_cache.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/procedural/procedural_town.h"

namespace pictura::test {

namespace {

constexpr MapCacheKey kKey{.importer = 1, .source = 2, .options = 3};

/// Exercises an accepted map.
void exercise(const RoadMap& map) {
  make_static_geometry(map);
  const std::string difference = first_difference(decode_map(encode_map(map, kKey), kKey, "cache"), map);
  if (!difference.empty()) {
    std::fprintf(stderr, "the cache does not restore a map exactly: %s\n", difference.c_str());
    std::abort();
  }
}

/// The payload of a valid map none of whose vectors is empty.
const std::string& valid_payload() {
  static const std::string payload = [] {
    RoadMap map = parse_opendrive(procedural_town({.blocks_x = 1, .blocks_y = 1}), "town");
    map.stop_lines = {{{1, 2, 3}, {4, 5, 6}, 0.3f}};
    map.sign_lanes = {0};
    map.signs = {{"1", "206", "-1", "OpenDRIVE", {1, 2, 3}, 0, {0, 1}}};
    map.provenance.stop_lines.assign(1, {0, 7});
    map.provenance.signs.assign(1, {0, 8});
    const std::string header = map_cache_header("", kKey);
    return encode_map(map, kKey).substr(header.size());
  }();
  return payload;
}

std::string edited(std::string payload, std::string_view edits) {
  constexpr std::size_t kEdit_bytes = 5;
  for (; edits.size() >= kEdit_bytes; edits.remove_prefix(kEdit_bytes)) {
    uint32_t position = 0;
    std::memcpy(&position, edits.data(), sizeof position);
    payload[position % payload.size()] = edits[sizeof position];
  }
  return payload;
}

/// Imports with repairs, then strictly. Returns whether the strict import made a map.
template <typename Import>
bool fuzz_import(Import&& import) {
  bool is_map = false;
  for (const bool strict : {false, true}) {
    is_map = false;
    try {
      exercise(import(strict));
      is_map = true;
    } catch (const Error&) {
    }
  }
  return is_map;
}

}  // namespace

bool fuzz_opendrive(std::string_view bytes) {
  return fuzz_import([&](bool strict) { return parse_opendrive(bytes, "fuzz.xodr", {.strict = strict}); });
}

bool fuzz_lanelet2(std::string_view bytes) {
  return fuzz_import([&](bool strict) { return parse_lanelet2(bytes, "fuzz.osm", {.strict = strict}); });
}

bool fuzz_map_cache(std::string_view bytes) {
  if (bytes.empty()) return false;
  const std::string_view rest = bytes.substr(1);
  std::string file(rest);
  if (bytes[0] == 'p') file = map_cache_header(rest, kKey) + std::string(rest);
  if (bytes[0] == 'e') {
    const std::string payload = edited(valid_payload(), rest);
    file = map_cache_header(payload, kKey) + payload;
  }
  try {
    exercise(decode_map(file, kKey, "fuzz"));
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace pictura::test
