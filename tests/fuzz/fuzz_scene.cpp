#include "pictura/tests/fuzz/fuzz_scene.h"

#include <cstdio>
#include <cstdlib>

#include "pictura/common/error.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scene_cache.h"
#include "pictura/map/womd/womd.h"
#include "pictura/tests/support/scene_fixture.h"

namespace pictura::test {

namespace {

constexpr SceneCacheKey kKey{.file = 1, .record = 2};

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

LoggedScene small_fixture() {
  return make_fixture({.num_steps = 3, .num_vehicles = 2, .num_pedestrians = 1, .num_cyclists = 1, .lane_points = 5});
}

}  // namespace

bool fuzz_scene(std::string_view bytes, const std::string& name) {
  try {
    exercise(name == "payload" ? make_scenario(womd::parse_scenario(bytes, "fuzz")) : parse_scenario_file(bytes, name));
    return true;
  } catch (const Error&) {
    return false;
  }
}

bool fuzz_scene_cache(std::string_view bytes) {
  if (bytes.empty()) return false;
  std::string file(bytes.substr(1));
  if (bytes[0] == 'e') {
    static const std::string sound = encode_scenario(make_scenario(small_fixture()), kKey);
    const std::string header = encode_cached(kKey, [](FieldWriter*) {});
    std::string payload = sound.substr(header.size());
    for (std::string_view edits = bytes.substr(1); edits.size() >= 3; edits.remove_prefix(3)) {
      const auto at = static_cast<unsigned char>(edits[0]) * 256u + static_cast<unsigned char>(edits[1]);
      payload[at % payload.size()] = edits[2];
    }
    file = encode_cached(kKey, [&](FieldWriter* writer) {
      for (const char byte : payload) writer->put(byte);
    });
  }
  try {
    exercise(decode_scenario(file, kKey, "fuzz"));
    return true;
  } catch (const Error&) {
    return false;
  }
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
      {"tails.bin", write_pufferdrive_tails(scene, 3)}};
}

}  // namespace pictura::test
