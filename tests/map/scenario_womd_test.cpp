// Records of the Waymo Open Motion Dataset (WOMD). Records that the tests write are read completely, with fields in any
// order. Faults of bytes, fields or files are reported with file, record and field.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/crc32c.h"
#include "pictura/common/support/file.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/womd/wire.h"
#include "pictura/map/womd/womd.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scene_fixture.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using test::ScratchFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

Scenario read_womd(const std::string& payload) {
  return make_scenario(womd::parse_scenario(payload, "shard: record 0"));
}

/// Fixture with the data that a WOMD record can hold.
LoggedScene womd_fixture(const test::FixtureOptions& options = {}) {
  LoggedScene scene = test::make_fixture(options);
  for (LoggedTrack& track : scene.tracks) track.control = RecordedControl::unstated;
  return scene;
}

/// Returns the reason of a refusal; empty if the payload is read.
std::string reason_of(const std::string& payload) {
  const std::string message = message_of([&] { read_womd(payload); });
  return message == test::kNoError ? "" : message;
}

/// Returns the reason for which a record of an edited fixture is refused.
std::string reason_of(const std::function<void(LoggedScene*)>& edit) {
  LoggedScene scene = test::make_fixture({.num_steps = 12});
  edit(&scene);
  return reason_of(test::write_womd(scene));
}

TEST(Crc32c, HasTheKnownValues) {
  EXPECT_EQ(crc32c("123456789"), 0xE3069283u);
  EXPECT_EQ(masked_crc32c("123456789"), 0xC78AB0E5u);
  EXPECT_EQ(crc32c(""), 0u);
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8A9136AAu);  // RFC 3720, B.4
  EXPECT_EQ(crc32c(std::string(32, '\xFF')), 0x62A8AB43u);
  // Both ways: by tables, as the compiler computes it, and by the processor's instruction, where it exists.
  constexpr std::string_view kText = "a text of some length, long enough for both ways";
  constexpr uint32_t kByTables = crc32c(kText);
  EXPECT_EQ(crc32c(std::string(kText)), kByTables);
}

TEST(Womd, EveryFieldIsReadInAnyOrderAndPacking) {
  const Scenario expected = make_scenario(womd_fixture());
  ASSERT_GT(expected.lights.size(), 2u);
  for (const bool descending : {false, true}) {
    for (const bool packed : {false, true}) {
      const test::WomdStyle style{.descending_fields = descending, .packed = packed, .unknown_fields = packed};
      const Scenario read = read_womd(test::write_womd(test::make_fixture(), style));
      EXPECT_EQ(first_difference(read, expected), "") << descending << packed;
    }
  }
}

TEST(Womd, SceneMatchesTheFixture) {
  const Scenario scenario = read_womd(test::write_womd(test::make_fixture()));
  EXPECT_EQ(scenario.id, "fixture00000001");
  EXPECT_EQ(scenario.num_steps, 91);
  EXPECT_EQ(scenario.current_step, 10);
  EXPECT_FLOAT_EQ(scenario.dt_s, 0.1f);
  EXPECT_EQ(scenario.sdc_track, 0);
  EXPECT_EQ(scenario.objects_of_interest, (std::vector<int32_t>{0, 11}));
  ASSERT_EQ(scenario.tracks_to_predict.size(), 2u);
  EXPECT_EQ(scenario.tracks_to_predict[0].difficulty, 1);
  EXPECT_EQ(scenario.tracks_to_predict[1].track, 2);
  const ScenarioFacts facts = facts_of(scenario);
  EXPECT_EQ(facts.vehicles, 8);
  EXPECT_EQ(facts.moving_vehicles, 4);
  EXPECT_EQ(facts.pedestrians, 3);
  EXPECT_EQ(facts.cyclists, 1);
  EXPECT_EQ(facts.tracks_with_gaps, 1);
  // A position of the first track in the file's coordinates: 16 m east of the crossing, on the ground.
  const Vec3 start = scenario.states_of(0)[0].position_m;
  EXPECT_NEAR(double{start.x} + scenario.map.origin_m[0], -7887.25 + 16, 1e-3);
  EXPECT_NEAR(double{start.y} + scenario.map.origin_m[1], 6796.5 + 1.75, 1e-3);
  EXPECT_NEAR(double{start.z} + scenario.map.origin_m[2], -186, 1e-3);
}

TEST(Womd, FramesOfInvalidStatesAreEmpty) {
  const Scenario scenario = read_womd(test::write_womd(test::make_fixture()));
  const auto last = static_cast<int32_t>(scenario.tracks.size()) - 1;
  EXPECT_EQ(scenario.valid_of(last)[0], 0);
  EXPECT_EQ(scenario.states_of(last)[0].position_m.z, 0) << "the file has a centre's height there";
  EXPECT_EQ(scenario.tracks[last].first_valid, 5);
}

TEST(Womd, TruncatedRecordsAreRefusedAtEveryLength) {
  const std::string payload = test::write_womd(test::make_fixture({.num_steps = 2, .num_vehicles = 2}));
  ASSERT_EQ(reason_of(payload), "");
  int refused = 0;
  for (std::size_t length = 0; length < payload.size(); length += 7) {
    const std::string reason = reason_of(payload.substr(0, length));
    refused += reason.empty() ? 0 : 1;
    if (!reason.empty()) {
      ASSERT_THAT(reason, HasSubstr("shard: record 0")) << length;
    }
  }
  // Only the ends of top-level fields leave a message, and only the last of them leaves all required fields.
  EXPECT_GT(refused, static_cast<int>(payload.size() / 7) - 10);
}

TEST(Womd, FaultyFieldsAreNamed) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::string record = "shard: record 0 (scenario fixture00000001): ";
  EXPECT_EQ(reason_of([&](LoggedScene* scene) { scene->tracks[3].states[4].center_m.x() = kNan; }),
            record + "tracks[3].states[4].center_x: expected a finite number, got nan");
  EXPECT_THAT(reason_of([&](LoggedScene* scene) { scene->lanes[2].points[5].y() = kNan; }),
              AllOf(HasSubstr(record), HasSubstr("map_features[2].lane.polyline[5].y: expected a finite number")));
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->tracks[1].states[10].width_m = 0; }),
            record + "tracks[1]: width: expected a number in (0, 100] at step 10, got 0");
  // Only the size at the current step counts.
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->tracks[1].states.back().width_m = 0; }), "");
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->sdc_track = 99; }),
            record + "sdc_track_index: expected an index in [0, 12), got 99");
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->predictions[1].first = -4; }),
            record + "tracks_to_predict: expected an index in [0, 12), got -4");
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->current_step = 12; }),
            record + "current_time_index: expected a step in [0, 12), got 12");
  EXPECT_EQ(reason_of([](LoggedScene* scene) {
              scene->lanes.clear();
              scene->lights.clear();
            }),
            record + "map_features: expected at least one lane, got none");
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->tracks.clear(); }),
            record + "sdc_track_index: expected an index in [0, 0), got 0");
  EXPECT_THAT(reason_of([](LoggedScene* scene) { scene->lanes[1].points[0].x() += 4e4; }),
              AllOf(HasSubstr(record), HasSubstr("expected coordinates within 10000 m of the map's centre")));
  EXPECT_EQ(reason_of([](LoggedScene* scene) { scene->lanes[1].id = scene->lanes[0].id; }),
            record + "lane 100: expected a unique id");
}

TEST(Womd, TracksHaveAStateForEveryTimestamp) {
  const std::string longer = test::write_womd(test::make_fixture({.num_steps = 5}));
  womd::WireReader fields(longer);
  std::string cut;
  // Omits the first timestamp: tag and value of nine bytes.
  cut = longer.substr(9);
  ASSERT_TRUE(fields.next());
  ASSERT_EQ(fields.field(), 1u);
  EXPECT_THAT(reason_of(cut), HasSubstr("tracks[0].states: expected one for each of the 4 timestamps, got 5"));
}

TEST(WireFormat, FaultsAreFound) {
  const auto reason = [](const std::string& bytes) -> std::string {
    try {
      womd::WireReader reader(bytes);
      while (reader.next()) {
      }
    } catch (const FieldError& error) {
      return error.reason;
    }
    return "";
  };
  EXPECT_EQ(reason(std::string("\x08\x96\x01", 3)), "");
  EXPECT_EQ(reason("\x08"), "expected a varint, got the end of the message");
  EXPECT_EQ(reason("\x08\x96"), "expected a varint, got the end of the message");
  const auto long_varint = [](std::size_t count, char byte, char last) {
    std::string bytes(count + 2, byte);
    bytes.front() = '\x08';
    bytes.back() = last;
    return bytes;
  };
  EXPECT_EQ(reason(long_varint(9, '\xFF', '\x01')), "");
  EXPECT_EQ(reason(long_varint(9, '\xFF', '\x02')), "expected a varint of at most 64 bits, got a longer varint");
  EXPECT_EQ(reason(long_varint(10, '\x80', '\x01')), "expected a varint of at most 64 bits, got a longer varint");
  EXPECT_EQ(reason("\x09"
                   "1234567"),
            "expected 8 bytes of a number, got the 7 remaining bytes of the message");
  EXPECT_EQ(reason("\x12\x05"
                   "1234"),
            "field 2: expected at most the 4 remaining bytes of its message, got a length of 5");
  for (const char type : {3, 4, 6, 7}) {
    EXPECT_THAT(reason(std::string(1, static_cast<char>(0x08 | type))), HasSubstr("expected wire type 0, 1, 2 or 5"));
  }
  EXPECT_THAT(reason(std::string(1, '\0')), HasSubstr("expected a field's tag, got 0x0"));
}

// Files --------------------------------------------------------------------------------------------------------------

std::string shard_of(int count) {
  std::vector<std::string> records;
  for (int i = 0; i < count; ++i) {
    const auto seed = static_cast<uint64_t>(i) + 1;
    records.push_back(
        test::write_womd(test::make_fixture({.seed = seed, .num_steps = 11}), {.descending_fields = i % 2 == 1}));
  }
  return test::write_tfrecord(records);
}

TEST(TfRecord, EveryFlippedBitIsFound) {
  const std::string file = test::write_tfrecord({"some bytes", "more"});
  for (std::size_t at = 0; at < file.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
      const womd::MemoryBytes bytes(damaged);
      const womd::RecordList list = womd::list_records(bytes, "shard");
      std::string reason = list.fault;
      for (std::size_t k = 0; k < list.records.size(); ++k) {
        const std::string message = message_of([&] { womd::read_record(bytes, "shard", k, list.records[k]); });
        if (message != test::kNoError) reason += message;
      }
      ASSERT_THAT(reason, HasSubstr("shard: record ")) << "byte " << at << ", bit " << bit;
    }
  }
}

TEST(TfRecord, TruncatedAndAbsurdFilesAreRefused) {
  const std::string file = test::write_tfrecord({"some bytes", "more"});
  const std::size_t second = 12 + 10 + 4;
  for (std::size_t length = 0; length <= file.size(); ++length) {
    const womd::MemoryBytes bytes(std::string_view(file).substr(0, length));
    const womd::RecordList list = womd::list_records(bytes, "shard");
    EXPECT_EQ(list.records.size(), length == file.size() ? 2u : length >= second ? 1u : 0u) << length;
    EXPECT_EQ(list.fault.empty(), length == 0 || length == second || length == file.size()) << length;
  }
  const uint64_t absurd = uint64_t{1} << 31;
  std::string header(reinterpret_cast<const char*>(&absurd), sizeof absurd);
  const uint32_t sum = masked_crc32c(header);
  header.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  EXPECT_EQ(womd::list_records(womd::MemoryBytes(header), "shard").fault,
            "shard: record 0: expected a length of at most 268435456 bytes, got 2147483648");
}

TEST(SceneNames, RecordsAreFoundByNumberAndId) {
  const ScratchFolder folder;
  const std::string shard = folder / "made.tfrecord-00000-of-00002";
  write_file(shard, shard_of(3));
  write_file(folder / "made.tfrecord-00001-of-00002", shard_of(1));
  EXPECT_EQ(load_scenario(shard).id, "fixture00000001");
  EXPECT_EQ(load_scenario(shard + "#2").id, "fixture00000003");
  EXPECT_EQ(load_scenario(shard + "#fixture00000002").id, "fixture00000002");
  EXPECT_EQ(load_scenario(folder.path() + "#3").id, "fixture00000001");
  EXPECT_EQ(load_scenario(folder.path() + "#fixture00000003").id, "fixture00000003");
  EXPECT_EQ(index_scenes(folder.path()).scenes.size(), 4u);
  EXPECT_EQ(message_of([&] { load_scenario(shard + "#3"); }),
            shard + ": expected #0 to #2 or the id of one of its scenes, got #3");
  EXPECT_EQ(message_of([&] { load_scenario(folder / "none.tfrecord"); }),
            folder / "none.tfrecord" + ": no such file or folder");
  LoggedScene other = test::make_fixture({.num_steps = 3});
  other.id = "other";
  write_file(folder / "other.json", test::write_gpudrive(other));
  write_file(folder / "faulty.json", "{}");
  EXPECT_EQ(load_scenario(folder.path() + "#other").map.name, "other");
  EXPECT_EQ(load_scenario(folder / "other.json#other").id, "other");
  EXPECT_TRUE(is_scene_name(shard + "#2"));
  EXPECT_TRUE(is_scene_name(folder.path() + "#2"));
  EXPECT_FALSE(is_scene_name("Town01"));
  EXPECT_FALSE(is_scene_name("procedural:7"));
}

TEST(SceneNames, FoldersWithoutScenesAndBadScenesAreNamed) {
  const ScratchFolder folder;
  write_file(folder / "notes.txt", "nothing");
  EXPECT_EQ(message_of([&] { index_scenes(folder.path()); }),
            folder.path() + ": expected scenes (.json, .bin, .scenario or .tfrecord files) in the folder, got none");
  const std::string file = shard_of(2);
  write_file(folder / "cut.tfrecord", file.substr(0, file.size() - 100));
  std::string damaged = file;
  damaged[40] = static_cast<char>(damaged[40] ^ 1);
  write_file(folder / "damaged.tfrecord", damaged);
  write_file(folder / "junk.tfrecord", "this is no TFRecord file");
  const SceneIndex index = index_scenes(folder.path());
  ASSERT_EQ(index.scenes.size(), 3u);
  ASSERT_EQ(index.faults.size(), 2u);
  EXPECT_THAT(index.faults[0], AllOf(HasSubstr("cut.tfrecord: record 1: truncated: expected")));
  EXPECT_THAT(index.faults[1], HasSubstr("junk.tfrecord: record 0: expected the checksum"));
  EXPECT_EQ(message_of([&] { load_scenario(index.scenes[0]); }), test::kNoError);
  EXPECT_THAT(message_of([&] { load_scenario(index.scenes[1]); }),
              AllOf(HasSubstr("damaged.tfrecord: record 0: expected the checksum"), HasSubstr(" of its ")));
  EXPECT_EQ(message_of([&] { load_scenario(index.scenes[2]); }), test::kNoError);
  // A shard without valid records reports this once.
  const std::string junk = folder / "junk.tfrecord";
  EXPECT_THAT(message_of([&] { find_scene(junk); }), ::testing::StartsWith(junk + ": record 0: expected"));
}

TEST(Womd, RandomlyChangedRecordsAreScenesOrErrors) {
  const std::string payload = test::write_womd(test::make_fixture({.num_steps = 4, .num_vehicles = 2}));
  std::mt19937 random(3);
  int scenes = 0, errors = 0;
  for (int i = 0; i < 400; ++i) {
    std::string changed = payload;
    for (std::size_t k = 0; k < 1 + random() % 3; ++k) changed[random() % changed.size()] = static_cast<char>(random());
    (reason_of(changed).empty() ? scenes : errors)++;
  }
  EXPECT_GT(scenes, 20);
  EXPECT_GT(errors, 20);
}

}  // namespace
}  // namespace pictura
