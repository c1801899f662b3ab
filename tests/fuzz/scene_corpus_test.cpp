// The first inputs of the scene fuzzers and mutations of these inputs, run in every test run: each gives a scene or an
// Error.
#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "pictura/tests/fuzz/fuzz_scene.h"

namespace pictura {
namespace {

/// Returns the file name of a seed: seeds of WOMD payloads have one name, whatever their style.
std::string seed_file_name(const std::string& seed) { return seed.substr(0, seed.find(' ')); }

TEST(FuzzScenes, EverySeedIsAScene) {
  for (const auto& [name, bytes] : test::scene_seeds())
    EXPECT_TRUE(test::fuzz_scene(bytes, seed_file_name(name))) << name;
}

TEST(FuzzScenes, MutatedSeedsAreScenesOrErrors) {
  std::mt19937 random(5);
  for (const auto& [name, bytes] : test::scene_seeds()) {
    int scenes = 0, errors = 0;
    for (int i = 0; i < 120; ++i) {
      std::string changed = bytes;
      for (std::size_t edits = 1 + random() % 2; edits > 0; --edits) {
        const std::size_t at = random() % changed.size(), count = std::min(changed.size() - at, 1 + random() % 16);
        switch (random() % 6) {
          case 0: changed.erase(at, count); break;
          case 1: changed.insert(at, changed.substr(at, count)); break;
          case 2: changed.resize(std::max(at, std::size_t{1})); break;
          default: changed[at] = static_cast<char>(random());
        }
      }
      (test::fuzz_scene(changed, seed_file_name(name)) ? scenes : errors)++;
    }
    EXPECT_GT(errors, 5) << name;
    // Checksums detect every change of a record.
    if (name.ends_with(".tfrecord")) {
      EXPECT_LT(scenes, 3);
    } else {
      EXPECT_GT(scenes, 0) << name;
    }
  }
}

TEST(FuzzScenes, EditedCachedScenesAreScenesOrErrors) {
  std::mt19937 random(6);
  int scenes = 0, errors = 0;
  for (int i = 0; i < 300; ++i) {
    std::string input = "e";
    for (std::size_t bytes = 3 * (1 + random() % 3); bytes > 0; --bytes) input += static_cast<char>(random());
    (test::fuzz_scene_cache(input) ? scenes : errors)++;
  }
  EXPECT_GT(scenes, 10);
  EXPECT_GT(errors, 10);
}

}  // namespace
}  // namespace pictura
