// The map cache: maps are restored bit for bit. Any other file is rejected with a reason, and load_map() then imports
// the source.
#include "pictura/map/map_cache.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/procedural/procedural_town.h"
#include "pictura/tests/map/small_roads.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

namespace fs = std::filesystem;
using test::EnvironmentVariable;
using test::ScratchFolder;
using ::testing::AnyOf;
using ::testing::HasSubstr;

constexpr MapCacheKey kKey{.importer = 0x1111, .source = 0x2222, .options = 0x3333};
// Offsets in the header.
constexpr std::size_t kVersionAt = 8, kByteOrderAt = 12, kImporterAt = 16, kSourceAt = 24, kOptionsAt = 32,
                      kPayloadBytesAt = 40, kHeaderBytes = 56;

std::string small_file(int num_roads = 1) {
  std::string roads;
  for (int i = 0; i < num_roads; ++i) {
    roads += test::RoadText{.id = std::to_string(i),
                            .geometry = test::line_at(0, 0, 50 * i, 0, 100),
                            .right = test::lane_of(-1, "driving", 3.5)}
                 .text();
  }
  return test::file_of(roads);
}

/// A map with content in every vector.
RoadMap full_map() {
  RoadMap map = parse_opendrive(procedural_town({.seed = 4}), "town");
  map.geo_reference = "+proj=tmerc +lat_0=49";
  map.stop_lines.push_back({{1, 2, 3}, {4, 5, 6}, 0.3f});
  map.sign_lanes = {0, 1};
  map.signs.push_back({"12", "206", "-1", "OpenDRIVE", {1, 2, 3}, 0.5f, {0, 2}});
  map.facts.signs = 1;
  map.mends.push_back(
      {RepairKind::repeated_signal, 18, "road 1: <signal>: attribute id: another signal already has 12"});
  map.provenance.stop_lines.assign(map.stop_lines.size(), {0, 17});
  map.provenance.signs.assign(map.signs.size(), {1, 18});
  return map;
}

std::string reason_of(const std::string& bytes, const MapCacheKey& key = kKey) {
  try {
    decode_map(bytes, key, "town.map");
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::StartsWith("town.map: "));
    return error.what();
  }
  return "(accepted)";
}

/// A file whose header matches the payload.
std::string with_header(const std::string& payload) { return map_cache_header(payload, kKey) + payload; }

TEST(MapCache, EveryFieldIsRestored) {
  const RoadMap map = full_map();
  EXPECT_EQ(first_difference(decode_map(encode_map(map, kKey), kKey, "town.map"), map), "");
  EXPECT_EQ(encode_map(map, kKey), encode_map(full_map(), kKey)) << "equal maps are equal bytes";
}

TEST(MapCache, DifferencesAreFoundAndNamed) {
  const RoadMap map = full_map();
  const std::vector<std::pair<const char*, std::function<void(RoadMap*)>>> changes = {
      {"origin_m[2]: 0 and 1", [](RoadMap* m) { m->origin_m[2] = 1; }},
      {"lanes[3].length_m: ", [](RoadMap* m) { m->lanes[3].length_m = std::nextafter(m->lanes[3].length_m, 1e3f); }},
      {"lanes[0].type: driving and sidewalk", [](RoadMap* m) { m->lanes[0].type = LaneType::sidewalk; }},
      {"signs[0].lanes.end: 2 and 1", [](RoadMap* m) { m->signs[0].lanes.end = 1; }},
      {"signs: 1 and 0 elements", [](RoadMap* m) { m->signs.clear(); }},
      {"geo_reference: '+proj=tmerc +lat_0=49' and ''", [](RoadMap* m) { m->geo_reference.clear(); }},
      {"origin_m[2]: 0 and -0", [](RoadMap* m) { m->origin_m[2] = -0.0; }},
      {"facts.z_max_m: ", [](RoadMap* m) { m->facts.z_max_m = 7; }},
      {"provenance.signs[0].line: 18 and 0", [](RoadMap* m) { m->provenance.signs[0].line = 0; }},
  };
  ASSERT_EQ(map.lanes[0].type, LaneType::driving);
  for (const auto& [expected, change] : changes) {
    RoadMap other = map;
    change(&other);
    EXPECT_THAT(first_difference(map, other), ::testing::StartsWith(expected));
  }
}

TEST(MapCache, TruncatedFilesAreRejectedAtEveryLength) {
  const std::string bytes = encode_map(parse_opendrive(small_file(), "small"), kKey);
  ASSERT_EQ(reason_of(bytes), "(accepted)");
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_THAT(reason_of(bytes.substr(0, length)), HasSubstr("truncated")) << "at " << length;
  }
  EXPECT_THAT(reason_of(bytes + "x"), HasSubstr("damaged"));
}

TEST(MapCache, EveryBitOfTheHeaderIsChecked) {
  const std::string bytes = encode_map(parse_opendrive(small_file(), "small"), kKey);
  for (std::size_t i = 0; i < kHeaderBytes; ++i) {
    const char* expected = i < kVersionAt        ? "foreign"
                           : i < kByteOrderAt    ? "expected version"
                           : i < kImporterAt     ? "byte order"
                           : i < kSourceAt       ? "stale: written by a different version of the importer"
                           : i < kOptionsAt      ? "stale: the map file has changed"
                           : i < kPayloadBytesAt ? "stale: written with different options"
                                                 : "";
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      if (*expected) {
        ASSERT_THAT(reason_of(damaged), HasSubstr(expected)) << "byte " << i << ", bit " << bit;
      } else {
        ASSERT_THAT(reason_of(damaged), AnyOf(HasSubstr("damaged"), HasSubstr("truncated"))) << "byte " << i;
      }
    }
  }
}

TEST(MapCache, ForeignFilesAndOtherKeysAreRejected) {
  EXPECT_THAT(reason_of("\x89PNG\r\n\x1a\n and so on"), HasSubstr("foreign: expected it to begin with PICTRMAP"));
  EXPECT_THAT(reason_of(small_file()), HasSubstr("foreign"));
  std::string bytes = encode_map(parse_opendrive(small_file(), "small"), kKey);
  MapCacheKey other = kKey;
  other.importer++;
  EXPECT_THAT(reason_of(bytes, other), HasSubstr("a different version of the importer"));
  other = kKey;
  other.source++;
  EXPECT_THAT(reason_of(bytes, other), HasSubstr("the map file has changed"));
  other = kKey;
  other.options++;
  EXPECT_THAT(reason_of(bytes, other), HasSubstr("different options"));
  std::reverse(bytes.begin() + kByteOrderAt, bytes.begin() + kImporterAt);
  EXPECT_THAT(reason_of(bytes), HasSubstr("a different byte order"));
}

TEST(MapCache, FlippedBytesAreRejected) {
  const std::string bytes = encode_map(full_map(), kKey);
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    std::string damaged = bytes;
    const std::size_t at = kHeaderBytes + random() % (bytes.size() - kHeaderBytes);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 + random() % 255));
    ASSERT_THAT(reason_of(damaged), HasSubstr("damaged: its bytes do not match the hash")) << "at " << at;
  }
}

TEST(MapCache, SizesAreCheckedBeforeAllocation) {
  const std::string bytes = encode_map(parse_opendrive(small_file(), "small"), kKey);
  const uint64_t huge = uint64_t{1} << 60;
  std::string damaged = bytes;
  std::memcpy(damaged.data() + kPayloadBytesAt, &huge, sizeof huge);
  EXPECT_THAT(reason_of(damaged), HasSubstr("truncated"));
  // The payload begins with the size of the map's name; its five letters, the origin and the empty geo reference are
  // followed by the number of roads.
  const std::string payload = bytes.substr(kHeaderBytes);
  for (const std::size_t at : {std::size_t{0}, sizeof huge + 5 + 3 * sizeof(double) + sizeof huge}) {
    for (const uint64_t size : {huge, uint64_t{payload.size()}, ~uint64_t{0}}) {
      damaged = payload;
      std::memcpy(damaged.data() + at, &size, sizeof size);
      EXPECT_THAT(reason_of(with_header(damaged)), HasSubstr(fmt::format("damaged: a size of {} elements", size)));
    }
  }
  EXPECT_EQ(reason_of(with_header(payload)), "(accepted)");
  EXPECT_THAT(reason_of(with_header(payload + "x")), HasSubstr("1 bytes remain"));
  EXPECT_THAT(reason_of(with_header(payload.substr(0, 4))), HasSubstr("damaged: expected 8 more bytes, got 4"));
}

TEST(MapCache, ContentWithAValidHashIsStillValidated) {
  RoadMap map = full_map();
  map.lanes[1].points.end = 1 << 30;
  EXPECT_THAT(reason_of(encode_map(map, kKey)), HasSubstr("lane 1: points"));
  map = full_map();
  map.lanes[1].type = static_cast<LaneType>(77);
  EXPECT_THAT(reason_of(encode_map(map, kKey)), HasSubstr("no enumerator has the number 77"));
  // A bool that is neither 0 nor 1, at the first byte in which two maps differ.
  map = full_map();
  std::string bytes = encode_map(map, kKey);
  map.lanes[0].is_endless = !map.lanes[0].is_endless;
  const std::string other = encode_map(map, kKey);
  *std::mismatch(bytes.begin() + kHeaderBytes, bytes.end(), other.begin() + kHeaderBytes).first = 2;
  EXPECT_THAT(reason_of(with_header(bytes.substr(kHeaderBytes))), HasSubstr("expected 0 or 1 for a bool, got 2"));
  // Damaged content with a valid hash gives a map or an Error.
  const std::string payload = encode_map(full_map(), kKey).substr(kHeaderBytes);
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    std::string damaged = payload;
    // The first kilobytes contain names and lanes, where most errors are possible.
    const std::size_t range = i % 2 ? payload.size() : 8192;
    for (int k = 0; k < 3; ++k) damaged[random() % range] = static_cast<char>(random());
    reason_of(with_header(damaged));
  }
}

class MapCacheFolder : public ::testing::Test {
 protected:
  void write_source(const std::string& text) { write_file(source_, text); }
  std::string cache_file() const { return map_cache_path(source_, {}); }
  /// Loads the source and returns how the cache was used.
  std::string outcome(const OpenDriveOptions& options = {}) {
    LoadReport report;
    map_ = load_map(source_, options, &report);
    return report.cached ? "cached" : report.cache_rejection.empty() ? "imported" : report.cache_rejection;
  }

  ScratchFolder folder_;
  EnvironmentVariable cache_home_{"XDG_CACHE_HOME", folder_ / "cache"}, cache_{"PICTURA_CACHE", std::nullopt};
  std::string source_ = folder_ / "small.xodr";
  std::shared_ptr<const RoadMap> map_;
};

TEST_F(MapCacheFolder, TheSecondLoadComesFromTheCache) {
  write_source(small_file());
  EXPECT_EQ(outcome(), "imported");
  const std::shared_ptr<const RoadMap> imported = map_;
  EXPECT_EQ(outcome(), "cached");
  EXPECT_EQ(first_difference(*map_, *imported), "");
  EXPECT_EQ(map_->name, "small");
  EXPECT_THAT(cache_file(), ::testing::StartsWith(folder_ / "cache/pictura/maps/small-"));
  EXPECT_TRUE(fs::exists(cache_file()));
}

TEST_F(MapCacheFolder, AMapIsNamedAfterItsLink) {
  write_source(small_file());
  const std::string file = source_;
  source_ = folder_ / "alias.xodr";
  fs::create_symlink(file, source_);
  EXPECT_EQ(outcome(), "imported");
  EXPECT_EQ(map_->name, "alias");
  source_ = file;
  EXPECT_EQ(outcome(), "cached");
  EXPECT_EQ(map_->name, "small");
}

TEST_F(MapCacheFolder, ChangedFilesAreImportedAgain) {
  write_source(small_file(1));
  outcome();
  write_source(small_file(2));
  EXPECT_THAT(outcome(), HasSubstr("stale: the map file has changed"));
  EXPECT_EQ(map_->road_names.size(), 2u);
  EXPECT_EQ(outcome(), "cached");
  EXPECT_EQ(map_->road_names.size(), 2u);
  write_source(small_file(1).substr(0, 300));
  EXPECT_THROW(outcome(), Error) << "a cached map does not replace a broken file";
}

TEST_F(MapCacheFolder, OtherOptionsHaveTheirOwnFile) {
  write_source(small_file());
  outcome();
  const OpenDriveOptions coarse{.chord_error_m = 0.5f};
  EXPECT_NE(map_cache_path(source_, coarse), cache_file());
  EXPECT_EQ(outcome(coarse), "imported");
  EXPECT_EQ(outcome(coarse), "cached");
  EXPECT_EQ(outcome(), "cached");
  fs::copy_file(map_cache_path(source_, coarse), cache_file(), fs::copy_options::overwrite_existing);
  EXPECT_THAT(outcome(), HasSubstr("stale: written with different options"));
  EXPECT_EQ(outcome(), "cached");
}

TEST_F(MapCacheFolder, AChangedImporterImportsAgain) {
  write_source(small_file());
  outcome();
  MapCacheKey key = map_cache_key(read_file(source_), {});
  key.importer++;
  write_file(cache_file(), encode_map(*map_, key));
  EXPECT_THAT(outcome(), HasSubstr("stale: written by a different version of the importer"));
  EXPECT_EQ(outcome(), "cached");
}

TEST_F(MapCacheFolder, DamagedCachesAreReplaced) {
  write_source(small_file());
  outcome();
  const std::string valid_bytes = read_file(cache_file());
  for (const std::string& bytes :
       {std::string(), valid_bytes.substr(0, 100), "\x7f" + valid_bytes, valid_bytes + "more"}) {
    write_file(cache_file(), bytes);
    EXPECT_THAT(outcome(), HasSubstr(cache_file()));
    EXPECT_EQ(outcome(), "cached");
    EXPECT_EQ(read_file(cache_file()), valid_bytes);
  }
  fs::remove(cache_file());
  fs::create_directory(cache_file());
  EXPECT_THAT(outcome(), HasSubstr("folder"));
  EXPECT_EQ(map_->road_names.size(), 1u);
}

TEST_F(MapCacheFolder, TheCacheCanBeTurnedOffOrBeMissing) {
  write_source(small_file());
  {
    const EnvironmentVariable off("PICTURA_CACHE", "off");
    EXPECT_EQ(outcome(), "imported");
    EXPECT_EQ(outcome(), "imported");
    EXPECT_EQ(cache_file(), "");
  }
  {
    const EnvironmentVariable invalid_cache("XDG_CACHE_HOME", "/proc/nowhere");
    EXPECT_EQ(outcome(), "imported");
    EXPECT_EQ(outcome(), "imported");
  }
  EXPECT_FALSE(fs::exists(folder_ / "cache"));
  const EnvironmentVariable none("XDG_CACHE_HOME", std::nullopt), home("HOME", folder_.path());
  EXPECT_THAT(cache_file(), ::testing::StartsWith(folder_ / ".cache/pictura/maps/small-"));
  const EnvironmentVariable no_home("HOME", std::nullopt);
  EXPECT_EQ(cache_file(), "");
}

TEST_F(MapCacheFolder, RepairsAreCachedWithTheMap) {
  // A road linked to a missing one.
  const std::string text = small_file();
  write_source(std::string(text).replace(text.find("<link>"), 6,
                                         R"(<link><successor elementType="road" elementId="9" )"
                                         R"(contactPoint="start"/>)"));
  for (const bool is_cached : {false, true}) {
    LoadReport report;
    const std::shared_ptr<const RoadMap> map = load_map(source_, {}, &report);
    EXPECT_EQ(report.cached, is_cached);
    ASSERT_EQ(map->mends.size(), 1u);
    EXPECT_THAT(message_of(map->mends[0], report.source), HasSubstr("small.xodr:5: road 0: <successor>"));
  }
  // Strict reading does not use a repaired map from the cache.
  EXPECT_THROW(outcome({.strict = true}), Error);
  write_source(text);
  EXPECT_EQ(outcome({.strict = true}), "imported");
  EXPECT_EQ(outcome({.strict = true}), "cached");
}

TEST_F(MapCacheFolder, ProceduralTownsAreNotCached) {
  LoadReport report;
  load_map("procedural:3", {}, &report);
  load_map("procedural:3", {}, &report);
  EXPECT_FALSE(report.cached);
  EXPECT_FALSE(fs::exists(folder_ / "cache"));
}

TEST_F(MapCacheFolder, CarlaTownsLoadInLessThan50Ms) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no .xodr files in " << map_folder() << " (set PICTURA_DATA)";
  // CPU time, since other programs share the machine.
  const auto load_ms = [](const std::string& town, LoadReport* report) {
    const std::clock_t begin = std::clock();
    load_map(town, {}, report);
    return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  fmt::print("{:10} {:>10} {:>10}\n", "town", "import ms", "cache ms");
  for (const std::string& town : towns) {
    LoadReport report;
    const double import_ms = load_ms(town, &report);
    EXPECT_FALSE(report.cached);
    double cache_ms = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 5; ++i) {
      cache_ms = std::min(cache_ms, load_ms(town, &report));
      EXPECT_TRUE(report.cached) << report.cache_rejection;
    }
    fmt::print("{:10} {:10.1f} {:10.1f}\n", town, import_ms, cache_ms);
    EXPECT_LT(cache_ms, PICTURA_IS_SANITIZED ? 1000 : 50) << town;
  }
}

}  // namespace
}  // namespace pictura
