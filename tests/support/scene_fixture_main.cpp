// Program with commands for tests in other languages:
//   scene_fixture write FOLDER    writes the fixture in every format, and its WOMD record as protobuf's JSON
//   scene_fixture compare A B     prints where two scenes differ; exits with 1 if they differ
//   scene_fixture many FILE N     writes a shard of N scenes as large as WOMD's
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/support/file.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/tests/support/scene_fixture.h"

namespace pictura {
namespace {

void write_all(const std::string& folder) {
  const LoggedScene scene = test::make_fixture();
  make_output_folder(folder);
  write_file(folder + "/womd.tfrecord", test::write_tfrecord({test::write_womd(scene)}));
  write_file(folder + "/womd_proto.json", test::write_womd_json(scene));
  write_file(folder + "/gpudrive.json", test::write_gpudrive(scene));
  for (const auto& [name, layout] : {std::pair{"v1", test::PufferLayout::v1}, std::pair{"v2", test::PufferLayout::v2},
                                     std::pair{"v3c", test::PufferLayout::v3c}}) {
    write_file(fmt::format("{}/pufferdrive_{}.bin", folder, name), test::write_pufferdrive(scene, layout));
  }
}

/// Writes scenes of 100 tracks, 20,000 points of the map and four lights: about 1 MB a record.
void write_many(const std::string& file, int count) {
  std::vector<std::string> records;
  for (int i = 0; i < count; ++i) {
    records.push_back(test::write_womd(test::make_fixture({.seed = static_cast<uint64_t>(i) + 1,
                                                           .num_vehicles = 70,
                                                           .num_pedestrians = 25,
                                                           .num_cyclists = 5,
                                                           .lane_points = 1000})));
  }
  write_file(file, test::write_tfrecord(records));
}

int run(const std::vector<std::string>& words) {
  if (words.size() == 2 && words[0] == "write") {
    write_all(words[1]);
    return 0;
  }
  if (words.size() == 3 && words[0] == "many") {
    write_many(words[1], std::atoi(words[2].c_str()));
    return 0;
  }
  if (words.size() == 3 && words[0] == "compare") {
    const std::string difference = first_difference(load_scenario(words[1]), load_scenario(words[2]));
    fmt::print("{}\n", difference);
    return difference.empty() ? 0 : 1;
  }
  fmt::print(stderr, "scene_fixture: expected write FOLDER, many FILE N or compare A B\n");
  return 2;
}

}  // namespace
}  // namespace pictura

int main(int argc, char** argv) {
  try {
    return pictura::run({argv + 1, argv + argc});
  } catch (const pictura::Error& error) {
    std::fprintf(stderr, "scene_fixture: %s\n", error.what());
    return 1;
  }
}
