#include "pictura/tests/fuzz/fuzz_scene.h"

#include <cstdio>
#include <cstdlib>
#include <functional>

#include "pictura/common/error.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scenario_fields.h"
#include "pictura/map/scenario/scene_cache.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/map/womd/womd.h"
#include "pictura/tests/support/scene_fixture.h"

namespace pictura::test {

namespace {

constexpr SceneCacheKey kKey{.content = 1, .record = 2};

void exercise(const Scenario& scenario) {
  make_static_geometry(scenario.map);
  logged_driving(scenario);
  facts_of(scenario);
  const std::string difference =
      first_difference(decode_scenario(encode_scenario(scenario, kKey), kKey, "cache"), scenario);
  if (!difference.empty()) {
    std::fprintf(stderr, "the cache does not restore a scene exactly: %s\n", difference.c_str());
    std::abort();
  }
}

/// Checks that a scene made from a scenario gives the same scenario again and again.
void check_scene_round_trip(const Scenario& scenario) {
  Scenario stated = make_scenario(scene_of_scenario(scenario));
  stated.notes.clear();
  Scenario again = make_scenario(scene_of_scenario(stated));
  again.notes.clear();
  const std::string difference = first_difference(stated, again);
  if (difference.empty()) return;
  std::fprintf(stderr, "what a scene states is another scene: %s\n", difference.c_str());
  std::abort();
}

LoggedScene small_fixture() {
  return make_fixture({.num_steps = 3, .num_vehicles = 2, .num_pedestrians = 1, .num_cyclists = 1, .lane_points = 5});
}

using Encode = std::function<std::string(const std::function<void(FieldWriter*)>& put)>;

std::string_view sound_fields() {
  static const std::string fields = [] {
    std::string bytes;
    FieldWriter(&bytes).put(make_scenario(small_fixture()));
    return bytes;
  }();
  return fields;
}

/// Reads bytes as a file of fields; see fuzz_scene_cache(). `encode` writes its header before the fields.
bool fuzz_fields(std::string_view bytes, const Encode& encode,
                 const std::function<Scenario(std::string_view)>& decode) {
  if (bytes.empty()) return false;
  const auto with_header = [&](std::string_view fields) {
    return encode([&](FieldWriter* writer) {
      for (const char byte : fields) writer->put(byte);
    });
  };
  std::string file(bytes.substr(1));
  if (bytes[0] == 'p') file = with_header(bytes.substr(1));
  if (bytes[0] == 'e') {
    std::string fields(sound_fields());
    for (std::string_view edits = bytes.substr(1); edits.size() >= 3; edits.remove_prefix(3)) {
      const auto at = static_cast<unsigned char>(edits[0]) * 256u + static_cast<unsigned char>(edits[1]);
      fields[at % fields.size()] = edits[2];
    }
    file = with_header(fields);
  }
  try {
    exercise(decode(file));
    return true;
  } catch (const Error&) {
    return false;
  }
}

bool fuzz_scene_file(std::string_view bytes) {
  return fuzz_fields(
      bytes, [](const auto& put) { return encode_fields(scene_file_kind(), {}, put); },
      [](std::string_view file) { return parse_scene_file(file, "fuzz.scenario"); });
}

}  // namespace

bool fuzz_scene(std::string_view bytes, const std::string& name) {
  if (name == "fields") return fuzz_scene_file(bytes);
  try {
    const Scenario scenario =
        name == "payload" ? make_scenario(womd::parse_scenario(bytes, "fuzz")) : parse_scenario_file(bytes, name);
    exercise(scenario);
    check_scene_round_trip(scenario);
    return true;
  } catch (const Error&) {
    return false;
  }
}

bool fuzz_scene_cache(std::string_view bytes) {
  return fuzz_fields(
      bytes, [](const auto& put) { return encode_cached(kKey, put); },
      [](std::string_view file) { return decode_scenario(file, kKey, "fuzz"); });
}

std::map<std::string, std::string> scene_seeds() {
  const LoggedScene scene = small_fixture();
  return {
      {"payload", write_womd(scene)},
      {"payload descending", write_womd(scene, {.descending_fields = true, .packed = true, .unknown_fields = true})},
      {"shard.tfrecord", write_tfrecord({write_womd(scene)})},
      {"scene.json", write_gpudrive(scene)},
      {"v1.bin", write_pufferdrive(scene, PufferLayout::v1)},
      {"v2.bin", write_pufferdrive(scene, PufferLayout::v2)},
      {"v2_with_id.bin", write_pufferdrive(scene, PufferLayout::v2_with_id)},
      {"v3c.bin", write_pufferdrive(scene, PufferLayout::v3c)},
      {"tails.bin", write_pufferdrive_tails(scene, 3)},
      {"fields", "p" + std::string(sound_fields())}};
}

}  // namespace pictura::test
