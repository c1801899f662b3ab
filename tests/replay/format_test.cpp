// Format of replays: written data are read back, and errors name the damage of a file.
#include <filesystem>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/replay/encoding.h"
#include "pictura/replay/file.h"
#include "pictura/replay/gallery.h"
#include "pictura/replay/images.h"
#include "pictura/replay/mcap.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using test::ScratchFolder;
using testing::HasSubstr;

/// Returns numbers of all sizes and both signs.
int32_t any_number(std::mt19937* random) {
  const auto bits = static_cast<uint32_t>((*random)());
  return static_cast<int32_t>(bits) >> (*random)() % 32;
}

std::string any_frames(const std::vector<ReplayCamera>& cameras, int count, std::mt19937* random) {
  std::string frames(bytes_of_frame(cameras) * static_cast<size_t>(count), '\0');
  // Runs, as every filter meets, and noise.
  for (size_t i = 0; i < frames.size(); ++i) frames[i] = static_cast<char>((*random)() % 8 == 0 ? (*random)() : i / 90);
  return frames;
}

Replay any_replay() {
  std::mt19937 random(7);
  Replay replay;
  replay.origin = {.command = "pictura replay '</script><b>'",
                   .commit = "0123456789ab",
                   .version = "1.2.3",
                   .map = "a & b",
                   .map_hash = "00ff00ff00ff00ff",
                   .map_origin_m = {388096, 3948996.5, -0.25},
                   .policy = "lane",
                   .policy_hash = "lane",
                   .light_cycles = "independent",
                   .seed = 18446744073709551615u,
                   .global_world = 3,
                   .dt_s = 0.05f};
  replay.first_infraction = {31, 2};
  replay.probed = ReplayCase{.what = "case 3: <b> & so on",
                             .frame = 49,
                             .ego = 2,
                             .inserted = ReplayBox{{AgentClass::pedestrian, 50, 50, 120}, -100, 200, 3, -900},
                             .path_cm = {{-100, 100}, {-100, 200}},
                             .answers = {{"a", 1.25, -0.5, 0.1, 0.7}, {"b", 0, 0, 0, 0}}};
  replay.metrics.collisions = 3;
  replay.metrics.km_driven = 1.25;
  replay.num_agents = 3;
  replay.num_frames = 50;
  replay.num_lights = 2;
  replay.followed = 1;
  for (int kind = 0; kind < kNumShapeKinds; ++kind) {
    ReplayShape shape{static_cast<ShapeKind>(kind), kind, 10 * kind, {}};
    const int num_points = shape.kind == ShapeKind::light ? static_cast<int>(kLightPoints) : kind;
    for (int i = 0; i < num_points; ++i) shape.points_cm.push_back({any_number(&random) / 4, any_number(&random) / 4});
    replay.map.push_back(shape);
  }
  replay.map.push_back(replay.map.back());  // as many lights as num_lights
  for (int32_t i = 0; i < 2; ++i) {
    ReplayEpisode episode{.index = 4 + i, .first_frame = 20 * i, .num_frames = 20 + 10 * i};
    episode.agents = {{AgentClass::vehicle, 450, 180, 150}, {AgentClass::cyclist, 180, 60, 170}, {}};
    for (size_t k = 0; k < 3 * kNumConditioning; ++k) episode.conditioning.push_back(0.1f * static_cast<float>(k));
    episode.parked = {{{AgentClass::vehicle, 400, 170, 140}, -100, 200, 3, 900}};
    episode.chains = {{20 * i, 2, {1, 2, 3}, {-4, -5, -6}, {7, 8, 9}}};
    replay.episodes.push_back(episode);
  }
  for (std::vector<int32_t>& track : replay.tracks) {
    for (int i = 0; i < replay.num_frames * replay.num_agents; ++i) track.push_back(any_number(&random));
  }
  for (int i = 0; i < replay.num_frames * replay.num_lights; ++i) {
    replay.lights.push_back(static_cast<uint8_t>(random() % kNumLightStates));
  }
  replay.followed_agents.assign(50, 1);
  replay.followed_agents[49] = 2;
  for (size_t i = 0; i < 50 * kDecisionValues; ++i) replay.decisions.push_back(any_number(&random));
  replay.scenery.lines = {{StripKind::crosswalk, {206, 131, 63}, 300, {{-100, 200, 3}, {-1100, 200, 7}, {5, 6, 8}}},
                          {StripKind::road_edge, {200, 36, 35}, 150, {}}};
  replay.scenery.walls = {{{141, 153, 174}, 950, {1, 2, 3}, {4, 5, -6}}};
  replay.scenery.heads = {{1, -900, 600, {700, 800, 500}}};
  replay.cameras = {{"front", 16, 9, 1.5f, 2.5f, 8.0f, 4.5f, 1.66f, -0.01f, 1.49f, 0.1f, 0.2f, 0.3f}, {"back", 5, 3}};
  replay.line_floor_px = 0.35f;
  replay.images.frames_per_group = 40;
  replay.images.groups = {pack_images(replay.cameras, any_frames(replay.cameras, 40, &random)),
                          pack_images(replay.cameras, any_frames(replay.cameras, 10, &random))};
  return replay;
}

TEST(ReplayFormat, NumbersOfAllSizesAreReadBack) {
  std::mt19937 random(1);
  std::vector<int32_t> numbers{0, 1, -1, 63, 64, -64, -65, INT32_MAX, INT32_MIN};
  for (int i = 0; i < 2000; ++i) numbers.push_back(any_number(&random));
  std::string bytes;
  for (const int32_t number : numbers) put_number(number, &bytes);
  NumberReader reader(bytes);
  for (const int32_t number : numbers) EXPECT_EQ(reader.next(), number);
  EXPECT_TRUE(reader.is_at_end());
  EXPECT_THAT(message_of([&] { reader.next(); }), HasSubstr("are truncated"));
  NumberReader too_long("\xff\xff\xff\xff\xff\xff");
  EXPECT_THAT(message_of([&] { too_long.next(); }), HasSubstr("expected a number of up to five bytes"));
}

TEST(ReplayFormat, DifferencesOfEachOrderAreReadBackAndSteadyMotionIsShort) {
  std::mt19937 random(2);
  for (int order = 0; order < 3; ++order) {
    std::vector<int32_t> values(300), back(300);
    for (int32_t& value : values) value = any_number(&random);
    std::string bytes;
    for (size_t column = 0; column < 3; ++column) put_differences(values.data() + column, 100, 3, order, &bytes);
    NumberReader reader(bytes);
    for (size_t column = 0; column < 3; ++column) read_differences(&reader, 100, 3, order, back.data() + column);
    EXPECT_EQ(values, back) << "order " << order;
  }
  std::vector<int32_t> steady(1000);
  for (size_t i = 0; i < steady.size(); ++i) steady[i] = 1000000 + 137 * static_cast<int32_t>(i);
  std::string bytes;
  put_differences(steady.data(), steady.size(), 1, 2, &bytes);
  EXPECT_LT(bytes.size(), 1010u);
}

TEST(ReplayFormat, Base64FollowsTheStandard) {
  // RFC 4648, section 10.
  const std::vector<std::pair<std::string, std::string>> vectors{{"", ""},
                                                                 {"f", "Zg=="},
                                                                 {"fo", "Zm8="},
                                                                 {"foo", "Zm9v"},
                                                                 {"foob", "Zm9vYg=="},
                                                                 {"fooba", "Zm9vYmE="},
                                                                 {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(base64(bytes), text);
    EXPECT_EQ(from_base64(text), bytes);
  }
  std::string all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<char>(i));
  EXPECT_EQ(from_base64(base64(all)), all);
  EXPECT_THAT(message_of([] { from_base64("Zm9"); }), HasSubstr("groups of 4"));
  EXPECT_THAT(message_of([] { from_base64("Zm9*"); }), HasSubstr("at 3"));
}

TEST(ReplayFormat, ImagesAreReadBackByteForByte) {
  std::mt19937 random(3);
  const std::vector<ReplayCamera> cameras{{"a", 33, 7}, {"b", 1, 1}, {"c", 8, 20}};
  for (const int count : {1, 2, 40}) {
    const std::string frames = any_frames(cameras, count, &random);
    EXPECT_EQ(unpack_images(cameras, pack_images(cameras, frames), count), frames);
  }
  const std::string packed = pack_images(cameras, any_frames(cameras, 2, &random));
  EXPECT_THAT(message_of([&] { unpack_images(cameras, packed.substr(0, 40), 2); }), HasSubstr("is truncated"));
  EXPECT_THAT(message_of([&] { unpack_images(cameras, packed.substr(0, 3), 2); }), HasSubstr("is truncated"));
  for (const size_t at : {size_t{9}, packed.size() / 2, packed.size() - 1}) {
    std::string damaged = packed;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    EXPECT_THAT(message_of([&] { unpack_images(cameras, damaged, 2); }), HasSubstr("images: a group")) << at;
  }
}

TEST(ReplayFormat, ManySmallGroupsAreReadBack) {
  // The predicted symbols use the upper part of the coder's range: black skies make long runs of 0xFF, also of the
  // first bytes, which a carry may reach or not.
  std::mt19937 random(5);
  const std::vector<ReplayCamera> cameras{{"a", 96, 54}};
  for (int i = 0; i < 300; ++i) {
    std::string frame(96 * 54 * 3, '\0');
    for (size_t k = random() % frame.size(); k < frame.size(); k += 1 + random() % 2000) {
      frame[k] = static_cast<char>(random());
    }
    ASSERT_EQ(unpack_images(cameras, pack_images(cameras, frame), 1), frame) << "group " << i;
  }
}

TEST(ReplayFormat, ImagesOfOneHueTakeLittleMoreSpaceThanGreyOnes) {
  const std::vector<ReplayCamera> cameras{{"a", 64, 64}};
  const std::vector<ReplayHue> hues = replay_hues();
  std::mt19937 random(4);
  std::string frame;
  for (int i = 0; i < 64 * 64; ++i) {
    const ReplayHue& hue = hues[2];
    const auto brightness = static_cast<int>(random() % 256);
    const int highest = std::max({hue[0], hue[1], hue[2]});
    for (const int channel : hue)
      frame.push_back(static_cast<char>((2 * channel * brightness + highest) / (2 * highest)));
  }
  const std::string packed = pack_images(cameras, frame);
  EXPECT_EQ(unpack_images(cameras, packed, 1), frame);
  EXPECT_LT(packed.size(), 64 * 64 * 1.35);  // for three times as many bytes
}

TEST(ReplayFormat, AReplayReadsBackEqual) {
  const ScratchFolder folder;
  const Replay replay = any_replay();
  write_replay(folder / "a.html", replay);
  EXPECT_TRUE(read_replay(folder / "a.html") == replay);
  const auto header = read_replay_header(folder / "a.html");
  EXPECT_EQ(header.at("command"), replay.origin.command);
  EXPECT_EQ(header.at("metrics").at("collisions"), 3);
  Replay removal = replay;
  removal.probed->inserted.reset();
  removal.probed->path_cm.clear();
  removal.probed->removed = 1;
  write_replay(folder / "b.html", removal);
  EXPECT_TRUE(read_replay(folder / "b.html") == removal);
  removal.probed.reset();
  write_replay(folder / "c.html", removal);
  EXPECT_TRUE(read_replay(folder / "c.html") == removal);
}

TEST(ReplayFormat, ExcessImagesAreLeftOutFromTheEnd) {
  const ScratchFolder folder;
  Replay replay = any_replay();
  replay.images.frames_per_group = 10;
  replay.images.groups.assign(5, std::string(kMaxWrittenImageBytes / 3, 'x'));
  EXPECT_EQ(replay.num_pictured_frames(), 50);
  write_replay(folder / "a.html", replay);
  const Replay back = read_replay(folder / "a.html");
  EXPECT_EQ(back.images.groups.size(), 3u);
  EXPECT_EQ(back.num_pictured_frames(), 30);
}

TEST(ReplayFormat, ErrorsNameDamagedParts) {
  const ScratchFolder folder;
  const std::string path = folder / "a.html";
  write_replay(path, any_replay());
  const std::string page = read_file(path);
  const auto message = [&](const std::string& damaged) {
    write_file(path, damaged);
    return message_of([&] { read_replay(path); });
  };
  const auto without = [&](const std::string& text, const std::string& other) {
    std::string damaged = page;
    damaged.replace(damaged.find(text), text.size(), other);
    return damaged;
  };
  EXPECT_THAT(message("<html>"), HasSubstr("a.html: expected a page of pictura replay, got a file without"));
  const size_t data = page.find("id=\"replay-data\">") + 17;
  EXPECT_THAT(message(page.substr(0, data + 200)), HasSubstr("ends within a replay's numbers"));
  std::string flipped = page;
  flipped[data + 101] = flipped[data + 101] == 'A' ? 'B' : 'A';
  EXPECT_THAT(message(flipped), HasSubstr("a damaged stream"));
  EXPECT_THAT(message(without("\"version\":2,", "\"version\":3,")),
              HasSubstr("expected a replay of version 2, got version 3"));
  EXPECT_THAT(message(without("\"agents\":3", "\"agents\":4")), HasSubstr("a.html"));
  EXPECT_THAT(message(without("\"agents\":3", "\"agents\":-1")), HasSubstr("agents: expected"));
  EXPECT_THAT(message(without("\"frame\":49", "\"frame\":50")), HasSubstr("case: expected a frame below 50, got 50"));
  EXPECT_THAT(message(without("\"ego\":2", "\"ego\":3")), HasSubstr("case: expected an agent below 3, got 3"));
  EXPECT_THAT(message(without("\"map_hash\"", "\"map_mash\"")), HasSubstr("a missing value"));
  EXPECT_THAT(message(without("{\"format\"", "{\"format")), HasSubstr("damaged JSON"));
}

TEST(ReplayFormat, ErrorsNameContentsThatDoNotMatchTheHeader) {
  const ScratchFolder folder;
  const auto message = [&](auto&& change) {
    Replay replay = any_replay();
    change(replay);
    write_replay(folder / "a.html", replay);
    return message_of([&] { read_replay(folder / "a.html"); });
  };
  EXPECT_THAT(message([](Replay& r) { r.episodes.pop_back(); }),
              HasSubstr("a.html: episodes: expected 50 frames, got 20"));
  EXPECT_THAT(message([](Replay& r) { r.episodes[1].first_frame = 19; }),
              HasSubstr("episodes: expected an episode of frames 20 to at most 49, got 30 frames from 19 on"));
  EXPECT_THAT(message([](Replay& r) { r.episodes[1].num_frames = 31; }), HasSubstr("got 31 frames from 20 on"));
  EXPECT_THAT(message([](Replay& r) { r.map.pop_back(); }), HasSubstr("map: expected 2 lights, got 1"));
  EXPECT_THAT(message([](Replay& r) { r.map.back().points_cm.pop_back(); }),
              HasSubstr("map: expected a light of 4 points, got 3"));
  EXPECT_THAT(message([](Replay& r) { r.followed_agents[3] = 3; }),
              HasSubstr("followed: expected an agent of 0 to 2, got 3"));
  EXPECT_THAT(message([](Replay& r) { r.images.frames_per_group = 0; }), HasSubstr("frames_per_group: expected 1 to "));
  EXPECT_THAT(message([](Replay& r) { r.images.frames_per_group = 1 << 30; }),
              HasSubstr("frames of 477 bytes, got 1073741824"));
  write_replay(folder / "a.html", any_replay());
  std::string page = read_file(folder / "a.html");
  const std::string lights = "\"name\":\"lights\"";
  page.replace(page.find(lights), lights.size(), "\"name\":\"events\"");
  write_file(folder / "a.html", page);
  EXPECT_THAT(message_of([&] { read_replay(folder / "a.html"); }), HasSubstr("a.html"));
}

TEST(ReplayFormat, McapFilesHoldTheAgentFollowedInEachFrame) {
  const ScratchFolder folder;
  write_mcap(folder / "a.mcap", any_replay());
  const std::string file = read_file(folder / "a.mcap");
  const auto count = [&file](const std::string& text) {
    int found = 0;
    for (size_t at = file.find(text); at != std::string::npos; at = file.find(text, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("{\"agent\":1,"), 49);
  EXPECT_EQ(count("{\"agent\":2,"), 1);
}

// MCAP's specification requires that the records of the summary are grouped by their operation codes.
TEST(ReplayFormat, TheSummaryOfAnMcapFileIsGrouped) {
  const ScratchFolder folder;
  write_mcap(folder / "a.mcap", any_replay());
  const std::string file = read_file(folder / "a.mcap");
  const auto number_at = [&file](size_t at) {
    uint64_t number = 0;
    for (size_t i = 8; i-- > 0;) number = number << 8 | static_cast<uint8_t>(file[at + i]);
    return number;
  };
  constexpr size_t kFooterBytes = 29, kMagicBytes = 8;
  const size_t footer = file.size() - kMagicBytes - kFooterBytes;
  std::string codes;  // one for each group
  for (size_t at = number_at(footer + 9); at < footer; at += 9 + number_at(at + 1)) {
    if (codes.empty() || codes.back() != file[at]) codes.push_back(file[at]);
  }
  EXPECT_EQ(codes, "\x03\x04\x0b\x08\x0d");  // schemas, channels, statistics, indexes of chunks and of metadata
}

TEST(ReplayFormat, MutatedHeadersAreReadOrRefused) {
  const ScratchFolder folder;
  const std::string path = folder / "a.html";
  write_replay(path, any_replay());
  const std::string page = read_file(path);
  const size_t begin = page.find("id=\"replay-header\">") + 19, end = page.find("</script>", begin);
  std::mt19937 random(6);
  int refused = 0;
  constexpr int kTries = 400;
  for (int i = 0; i < kTries; ++i) {
    std::string damaged = page;
    // Digits, which keep the JSON valid, more often than other characters.
    for (int k = 0; k < 3;) {
      const size_t at = begin + random() % (end - begin);
      const bool is_digit = damaged[at] >= '0' && damaged[at] <= '9';
      if (!is_digit && random() % 16 != 0) continue;
      damaged[at] = is_digit ? static_cast<char>('0' + random() % 10) : static_cast<char>(' ' + random() % 95);
      ++k;
    }
    write_file(path, damaged);
    Replay replay;
    try {
      replay = read_replay(path);
    } catch (const Error&) {
      ++refused;
      continue;
    }
    try {
      for (const std::string& group : replay.images.groups) {
        unpack_images(replay.cameras, group, replay.images.frames_per_group);
      }
    } catch (const Error&) {
      // Images are checked only when they are shown.
    }
  }
  EXPECT_GT(refused, kTries / 4);
}

TEST(ReplayFormat, AGalleryListsTheWorstFirst) {
  const ScratchFolder folder;
  Replay replay = any_replay();
  for (const auto& [name, red_lights] : {std::pair{"a.html", 0}, {"b.html", 9}, {"c.html", 4}}) {
    replay.metrics.red_light = red_lights;
    write_replay(folder / name, replay);
  }
  EXPECT_EQ(write_gallery(folder.path()), 3);
  const std::string index = read_file(folder / "index.html");
  EXPECT_LT(index.find("b.html"), index.find("c.html"));
  EXPECT_LT(index.find("c.html"), index.find("a.html"));
  EXPECT_EQ(write_gallery(folder.path()), 3);  // without the index
  write_file(folder / "other.html", "<p>no replay</p>");
  EXPECT_THAT(message_of([&] { check_gallery(folder.path()); }), HasSubstr("other.html: expected a page of pictura"));
  EXPECT_THAT(message_of([&] { write_gallery(folder.path()); }), HasSubstr("other.html: expected a page of pictura"));
}

TEST(ReplayFormat, AGalleryReplacesDamagedPagesOfAnEarlierOne) {
  const ScratchFolder folder;
  write_file(FilledFolder(folder.path(), "gallery").file("seed_0.html"), "<p>a page of another version</p>");
  check_gallery(folder.path());
  EXPECT_THAT(message_of([&] { write_gallery(folder.path()); }), HasSubstr("seed_0.html: expected a page of pictura"));
}

TEST(ReplayFormat, AGalleryReplacesNoOtherPageAndNamesMissingHeaderValues) {
  const ScratchFolder folder;
  write_replay(folder / "a.html", any_replay());
  write_file(folder / "index.html", "<p>mine</p>");
  EXPECT_THAT(message_of([&] { check_gallery(folder.path()); }), HasSubstr("index.html: expected an index of replays"));
  EXPECT_THAT(message_of([&] { write_gallery(folder.path()); }), HasSubstr("index.html: expected an index of replays"));
  EXPECT_EQ(read_file(folder / "index.html"), "<p>mine</p>");
  std::filesystem::remove(folder / "index.html");
  std::string page = read_file(folder / "a.html");
  page.replace(page.find("\"metrics\"", page.find("id=\"replay-header\">")), 9, "\"metrix_\"");
  write_file(folder / "a.html", page);
  EXPECT_THAT(message_of([&] { write_gallery(folder.path()); }), HasSubstr("a.html: expected a replay's header"));
}

TEST(ReplayFormat, ForeignTextsAreEscaped) {
  const ScratchFolder folder;
  Replay replay = any_replay();
  replay.origin.map = "{{elements}}</script>";
  replay.origin.policy = "caf\xe9";  // no UTF-8
  write_replay(folder / "a.html", replay);
  const Replay read = read_replay(folder / "a.html");
  EXPECT_EQ(read.origin.map, replay.origin.map);
  EXPECT_EQ(read.origin.policy, "caf\uFFFD");
  EXPECT_THAT(read_file(folder / "a.html"), HasSubstr("<title>{{elements}}&lt;/script&gt;"));
  write_mcap(folder / "a.mcap", replay);
  EXPECT_EQ(write_gallery(folder.path()), 1);
}

TEST(ReplayFormat, AnOversizedFirstGroupOfImagesLeavesNoImages) {
  const ScratchFolder folder;
  Replay replay = any_replay();
  replay.images.groups = {std::string(size_t{8} << 20, 'x'), "y"};
  write_replay(folder / "a.html", replay);
  EXPECT_TRUE(read_replay_header(folder / "a.html").at("images").is_null());
  EXPECT_TRUE(read_replay(folder / "a.html").images.groups.empty());
}

}  // namespace
}  // namespace pictura
