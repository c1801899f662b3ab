// The fuzzers' corpus, run in every test run: each file, and each mutation of a file, gives a map or an Error in
// bounded time.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/tests/fuzz/fuzz_map.h"

namespace pictura {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> corpus(const std::string& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(PICTURA_CORPUS) / folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Returns CPU time, since other programs share the machine.
template <typename Fuzz>
double seconds_of(Fuzz fuzz) {
  const std::clock_t begin = std::clock();
  fuzz();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

/// Mutates bytes: flips, insertions, deletions and changed digits, a few at a time.
std::string mutated(std::string bytes, std::mt19937* random) {
  const auto below = [&](size_t count) { return count ? (*random)() % count : 0; };
  for (size_t edits = 1 + below(2); edits > 0 && !bytes.empty(); --edits) {
    const size_t at = below(bytes.size()), length = std::min(1 + below(40), bytes.size() - at);
    switch (below(10)) {
      case 0: bytes[at] = static_cast<char>((*random)()); break;
      case 1: bytes.erase(at, length); break;
      case 2: bytes.insert(below(bytes.size()), bytes.substr(at, length)); break;
      case 3: bytes.resize(at); break;
      default: {
        // Change a digit, because most of the content is numbers.
        const size_t digit = bytes.find_first_of("0123456789", at);
        if (digit != std::string::npos) bytes[digit] = "0123456789-.e"[below(13)];
      }
    }
  }
  return bytes;
}

TEST(FuzzCorpus, EveryOpenDriveFileIsAMapOrAnError) {
  int maps = 0, errors = 0;
  for (const fs::path& path : corpus("opendrive")) {
    (test::fuzz_opendrive(read_file(path.string())) ? maps : errors)++;
  }
  // Both outcomes occur.
  EXPECT_GT(maps, 15);
  EXPECT_GT(errors, 15);
}

TEST(FuzzCorpus, EveryLanelet2FileAndItsMutationsAreMapsOrErrors) {
  std::mt19937 random(13);
  int maps = 0, errors = 0, changed_maps = 0;
  for (const fs::path& path : corpus("lanelet2")) {
    const std::string bytes = read_file(path.string());
    (test::fuzz_lanelet2(bytes) ? maps : errors)++;
    for (int i = 0; i < 100; ++i) changed_maps += test::fuzz_lanelet2(mutated(bytes, &random)) ? 1 : 0;
  }
  EXPECT_GE(maps, 6);
  EXPECT_GE(errors, 5);
  EXPECT_GT(changed_maps, 100);
}

/// Worst cases for small files: long, tightly wound and overlapping roads.
TEST(FuzzCorpus, SmallFilesTakeLittleTime) {
  for (const fs::path& path : corpus("opendrive_slow")) {
    const std::string bytes = read_file(path.string());
    ASSERT_LE(bytes.size(), size_t{65536}) << path;
    const double seconds = seconds_of([&] { test::fuzz_opendrive(bytes); });
    fmt::print("{:20} {:6.2f} s\n", path.stem().string(), seconds);
    EXPECT_LT(seconds, PICTURA_IS_SANITIZED ? 200 : 6) << path << ", imported twice";
  }
}

TEST(FuzzCorpus, MutatedOpenDriveFilesAreMapsOrErrors) {
  std::mt19937 random(11);
  int maps = 0, errors = 0;
  for (const fs::path& path : corpus("opendrive")) {
    const std::string bytes = read_file(path.string());
    if (bytes.size() > 8192) continue;  // slow under sanitizers
    for (int i = 0; i < 60; ++i) (test::fuzz_opendrive(mutated(bytes, &random)) ? maps : errors)++;
  }
  EXPECT_GT(maps, 100);
  EXPECT_GT(errors, 500);
}

TEST(FuzzCorpus, EveryCachedMapIsAMapOrAnError) {
  for (const fs::path& path : corpus("map_cache")) {
    const bool is_sound = path.filename() == "sound";
    EXPECT_TRUE(test::fuzz_map_cache(read_file(path.string())) || !is_sound) << path;
  }
}

TEST(FuzzCorpus, EditedCachedMapsAreMapsOrErrors) {
  std::mt19937 random(12);
  int maps = 0, errors = 0;
  for (int i = 0; i < 400; ++i) {
    std::string input = "e";
    for (size_t bytes = 5 * (1 + random() % 3); bytes > 0; --bytes) input += static_cast<char>(random());
    (test::fuzz_map_cache(input) ? maps : errors)++;
  }
  EXPECT_GT(maps, 20);
  EXPECT_GT(errors, 20);
}

}  // namespace
}  // namespace pictura
