// GPUDrive's JSON and PufferDrive's binary layouts. The tests write a scene to a file; reading the file gives the same
// scene, as far as the format allows. Faults are reported with file and field.
#include <cmath>
#include <cstring>
#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/map/gpudrive/gpudrive.h"
#include "pictura/map/pufferdrive/pufferdrive.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scene_fixture.h"

namespace pictura {
namespace {

using test::message_of;
using test::PufferLayout;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr PufferLayout kLayouts[] = {PufferLayout::v1, PufferLayout::v2, PufferLayout::v2_with_id, PufferLayout::v3c};

Scenario read_json(const std::string& text) { return parse_scenario_file(text, "scene.json"); }
Scenario read_binary(const std::string& bytes) { return parse_scenario_file(bytes, "scene.bin"); }

/// Maximum distance between two scenarios' states, in the coordinates of their files.
double largest_distance(const Scenario& a, const Scenario& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.states.size(); ++i) {
    if (!a.valid[i]) continue;
    const Vec3 p = a.states[i].position_m, q = b.states[i].position_m;
    largest = std::max({largest, std::abs(double{p.x} + a.map.origin_m[0] - double{q.x} - b.map.origin_m[0]),
                        std::abs(double{p.y} + a.map.origin_m[1] - double{q.y} - b.map.origin_m[1]),
                        std::abs(double{p.z} + a.map.origin_m[2] - double{q.z} - b.map.origin_m[2]),
                        std::abs(double{a.states[i].heading_rad} - double{b.states[i].heading_rad}),
                        double{length(a.states[i].velocity_mps - b.states[i].velocity_mps)}});
  }
  return largest;
}

/// Links as pairs of lanes, which both scenes list in the same order.
std::vector<std::vector<int32_t>> successors_of(const RoadMap& map) {
  std::vector<std::vector<int32_t>> all;
  for (const Lane& lane : map.lanes) {
    const Span<const int32_t> links = map.links(lane.successors);
    all.emplace_back(links.begin(), links.end());
  }
  return all;
}

void expect_same_tracks(const Scenario& read, const Scenario& expected, double tolerance) {
  ASSERT_EQ(read.tracks.size(), expected.tracks.size());
  EXPECT_EQ(read.num_steps, expected.num_steps);
  EXPECT_EQ(read.valid, expected.valid);
  EXPECT_LE(largest_distance(read, expected), tolerance);
  for (std::size_t i = 0; i < read.tracks.size(); ++i) {
    EXPECT_EQ(read.tracks[i].type, expected.tracks[i].type);
    EXPECT_EQ(read.tracks[i].control, expected.tracks[i].control);
    EXPECT_EQ(read.tracks[i].length_m, expected.tracks[i].length_m) << i;
    EXPECT_EQ(read.tracks[i].width_m, expected.tracks[i].width_m) << i;
  }
}

TEST(GpuDrive, SceneIsReadAsWritten) {
  const LoggedScene fixture = test::make_fixture();
  const Scenario expected = make_scenario(fixture), read = read_json(test::write_gpudrive(fixture));
  expect_same_tracks(read, expected, 1e-6);
  EXPECT_EQ(read.id, fixture.id);
  EXPECT_EQ(read.format, "gpudrive");
  EXPECT_EQ(read.sdc_track, expected.sdc_track);
  EXPECT_EQ(read.objects_of_interest, expected.objects_of_interest);
  EXPECT_EQ(read.tracks_to_predict.size(), 2u);
  EXPECT_EQ(read.map.lanes.size(), expected.map.lanes.size());
  EXPECT_EQ(read.map.markings.size(), expected.map.markings.size());
  EXPECT_EQ(read.map.road_edges.size(), expected.map.road_edges.size());
  EXPECT_EQ(read.map.crosswalks.size(), 1u);
  EXPECT_EQ(read.map.signs.size(), 1u);
  EXPECT_EQ(read.lights.size(), expected.lights.size());
  EXPECT_EQ(read.light_states, expected.light_states);
  // The format has no links; lanes meet exactly where the recording links them.
  EXPECT_EQ(successors_of(read.map), successors_of(expected.map));
}

TEST(GpuDrive, FaultsAreNamed) {
  const std::string text = test::write_gpudrive(test::make_fixture({.num_steps = 3, .num_vehicles = 2}));
  const auto reason = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    return message_of([&] { read_json(changed); });
  };
  EXPECT_EQ(reason("\"objects\"", "\"object\""), "scene.json: objects: is missing");
  EXPECT_EQ(reason("\"valid\":[true", "\"valid\":[2"),
            "scene.json: objects[0].valid[0]: expected true or false, got 2");
  EXPECT_EQ(reason("\"valid\":[true,", "\"valid\":["), "scene.json: objects[0].valid: expected 3 steps, got 2");
  EXPECT_EQ(reason("\"heading\":[", "\"heading\":[null,"), "scene.json: objects[0].heading: expected 3 steps, got 4");
  EXPECT_EQ(reason("\"map_element_id\":2", "\"map_element_id\":\"lane\""),
            "scene.json: roads[0].map_element_id: expected a whole number, got string");
  EXPECT_EQ(reason("\"map_element_id\":2", "\"map_element_id\":18446744073709551615"),
            "scene.json: roads[0].map_element_id: expected a number of at most 1000000000 in magnitude, got "
            "18446744073709551615");
  EXPECT_THAT(reason("{\"name\"", "{name"), HasSubstr("scene.json: expected JSON, got a parse error at line 1"));
  EXPECT_EQ(reason("\"x\":", "\"x\":NaN,\"u\":"), "scene.json: objects[0].position[0].x: expected a number, got null");
  EXPECT_THAT(reason("\"x\":", "\"x\":1e300,\"u\":"), HasSubstr("scene.json: objects[0].position[0].x: expected"));
  EXPECT_THAT(message_of([] { read_json(""); }), HasSubstr("scene.json: expected JSON"));
  EXPECT_THAT(message_of([] { read_json("[]"); }), HasSubstr("scene.json: expected an object, got array"));
  EXPECT_THAT(message_of([] { read_json(std::string(200'000, '[')); }), HasSubstr("scene.json: expected JSON"));
}

/// Scenes like those of earlier versions of GPUDrive and of other writers: two vehicles on a road of two lanes, 91
/// steps.
struct OldScene {
  bool has_z = false, has_ids = false, has_degrees = false;
  std::string height, more, lights = "{}";
  std::string invalid = R"({"x":0.0001,"y":0.0001})";  // position while the second vehicle is absent
  int32_t first_step = 0;                              // first step of the second vehicle

  std::string list(const std::function<std::string(int)>& of_step, int count = 91) const {
    std::string text;
    for (int step = 0; step < count; ++step) text += (step ? "," : "") + of_step(step);
    return "[" + text + "]";
  }
  std::string point(double x, double y) const {
    return fmt::format(R"({{"x":{},"y":{}{}}})", x, y, has_z ? R"(,"z":-122.8)" : "");
  }
  std::string vehicle(int id, double x, double y, double speed_mps, int32_t first, const std::string& own = "") const {
    const bool turned = speed_mps < 0;
    const std::string heading = has_degrees ? (turned ? "180" : "0") : (turned ? "3.14159265" : "0.0");
    return fmt::format(
        R"({{"type":"vehicle","width":2.0,"length":4.5{}{}{},"goalPosition":{},"position":{},"heading":{},"velocity":{},)"
        R"("valid":{}}})",
        height, own, has_ids ? fmt::format(R"(,"id":{})", id) : "", point(0, 0),
        list([&](int step) { return step < first ? invalid : point(x + 0.1 * speed_mps * step, y); }),
        list([&](int step) { return step < first ? "0.0001" : heading; }),
        list([&](int) { return fmt::format(R"({{"x":{},"y":0.0}})", speed_mps); }),
        list([&](int step) { return step < first ? "false" : "true"; }));
  }
  std::string road(int id, const std::string& type, int element, double from_x, double to_x, double y) const {
    return fmt::format(R"({{"type":"{}"{},"geometry":{}}})", type,
                       has_ids ? fmt::format(R"(,"id":{},"map_element_id":{})", id, element) : "",
                       list([&](int i) { return point(from_x + (to_x - from_x) * i / 140, y); }, 141));
  }
  std::string text(const std::string& of_second = "") const {
    return R"({"name":"old.json",)" + more + R"("objects":[)" + vehicle(7, 0, 0, 8, 0) + "," +
           vehicle(8, 100, 3.6, -7, first_step, of_second) + R"(],"roads":[)" + road(10, "lane", 2, -20, 120, 0) + "," +
           road(11, "lane", 2, 120, -20, 3.6) + "," + road(12, "road_edge", 15, -20, 120, -1.8) + "," +
           road(13, "road_edge", 15, 120, -20, 5.4) + "," + road(14, "road_line", 11, -20, 120, 1.8) +
           R"(],"tl_states":)" + lights + "}";
  }
};

std::vector<std::string> notes_of(const Scenario& scene) {
  std::vector<std::string> notes;
  for (const ConversionNote& note : scene.notes) notes.push_back(fmt::format("{} {}", note.count, note.what));
  return notes;
}

TEST(GpuDrive, FlatFilesWithoutIdsAndWithDegreesAreRead) {
  const Scenario scene = read_json(OldScene{.has_degrees = true}.text());
  ASSERT_EQ(scene.tracks.size(), 2u);
  EXPECT_EQ(scene.tracks[1].id, 1);
  EXPECT_FLOAT_EQ(scene.tracks[0].height_m, 1.6f);
  const auto second = static_cast<std::size_t>(scene.num_steps);
  EXPECT_FLOAT_EQ(scene.states[0].velocity_mps.x, 8);
  EXPECT_FLOAT_EQ(scene.states[second].velocity_mps.x, -7);
  EXPECT_EQ(scene.states[0].heading_rad, 0);
  EXPECT_NEAR(std::abs(scene.states[second].heading_rad), M_PI, 1e-6);
  EXPECT_NEAR(scene.states[0].position_m.z, 0, 1e-6) << "on the ground";
  EXPECT_EQ(scene.map.lanes.size(), 2u);
  EXPECT_EQ(scene.map.markings.size(), 1u);
  EXPECT_FALSE(scene.map.road_edges.empty());
  EXPECT_THAT(notes_of(scene),
              ::testing::UnorderedElementsAre("2 objects without an id: their places count",
                                              "2 objects without a height: vehicles are 1.6 m high, others 1.7 m",
                                              "2 tracks whose headings are degrees"));
}

TEST(GpuDrive, HeadingsAreDegreesOnlyIfTheyFit) {
  EXPECT_NEAR(std::abs(read_json(OldScene{}.text()).states[91].heading_rad), M_PI, 1e-6);
  // Headings that exceed a whole turn are not degrees where the motion fits radians; without a motion, they are.
  std::string text = OldScene{}.text();
  const auto replace_all = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
  };
  replace_all("3.14159265", "9.42477796");
  EXPECT_NEAR(std::abs(read_json(text).states[91].heading_rad), M_PI, 1e-6);
  replace_all(R"({"x":-7,"y":0.0})", R"({"x":0,"y":0.0})");
  replace_all(R"({"x":8,"y":0.0})", R"({"x":0,"y":0.0})");
  EXPECT_NEAR(read_json(text).states[91].heading_rad, 9.42477796 * M_PI / 180, 1e-6);
}

// Such headings fit slightly better as degrees.
TEST(GpuDrive, HeadingsOfTrafficAlongXAreRadians) {
  std::string text = OldScene{}.text();
  for (const auto& [from, to] : {std::pair{R"("heading":[0.0)", R"("heading":[0.01)"}, {"3.14159265", "0.01"}}) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; ++at) {
      text.replace(at, std::string_view(from).size(), to);
    }
  }
  for (std::size_t at = 0; (at = text.find("-7", at)) != std::string::npos;) text.replace(at, 2, "7");
  const Scenario scene = read_json(text);
  EXPECT_FLOAT_EQ(scene.states[0].heading_rad, 0.01f);
  EXPECT_FLOAT_EQ(scene.states[91].heading_rad, 0.01f);
}

TEST(GpuDrive, LightsAreReadFromObjectsAndLists) {
  OldScene old{.has_z = true, .has_ids = true, .height = R"(,"height":1.6)", .more = R"("scenario_id":4711,)"};
  old.first_step = 30;
  const std::string states = R"("state":)" + old.list([](int step) { return step < 40 ? R"("stop")" : R"("go")"; }) +
                             R"(,"time_index":)" + old.list([](int step) { return std::to_string(step); });
  for (const std::string& lights :
       {"{\"10\":{" + states + "}}", "[{\"lane\":10," + states + "}]", "[{\"lane_id\":\"10\"," + states + "}]"}) {
    old.lights = lights;
    for (const char* invalid :
         {R"({"x":0.0001,"y":0.0001,"z":0.0001})", "null", "\"nothing\"", R"({"x":NaN,"y":-Infinity})"}) {
      old.invalid = invalid;
      const Scenario scene = read_json(old.text());
      EXPECT_EQ(scene.id, "4711");
      ASSERT_EQ(scene.lights.size(), 1u);
      for (std::size_t step = 0; step < 91; ++step) {
        EXPECT_EQ(scene.light_states[step], step < 40 ? RecordedLightState::stop : RecordedLightState::go);
      }
      ASSERT_EQ(scene.tracks.size(), 2u);
      EXPECT_EQ(scene.tracks[1].first_valid, 30);
      EXPECT_EQ(scene.tracks[1].id, 8);
      EXPECT_THAT(scene.notes, ::testing::IsEmpty());
    }
  }
  for (const char* lights : {"[]", "{}", "null"}) {
    old.lights = lights;
    EXPECT_EQ(read_json(old.text()).lights.size(), 0u);
  }
}

TEST(GpuDrive, LightsBelongToLanesThoughOtherRoadsHaveTheirId) {
  OldScene old{.has_z = true, .has_ids = true, .height = R"(,"height":1.6)"};
  old.lights = R"({"11":{"state":["stop"]}})";
  std::string text = old.text();
  const std::string road = old.road(11, "road_line", 11, -20, 120, 1.8) + ",";
  text.insert(text.find(R"("roads":[)") + 9, road);
  const Scenario scene = read_json(text);
  EXPECT_EQ(scene.lights.size(), 1u);
  EXPECT_THAT(scene.notes, ::testing::IsEmpty());
}

TEST(GpuDrive, AnObjectFlagSelectsTheSelfDrivingCar) {
  const OldScene old{.more = R"("metadata":{"sdc_track_index":0},)"};
  EXPECT_EQ(read_json(old.text()).sdc_track, 0);
  EXPECT_EQ(read_json(old.text(R"(,"is_sdc":false)")).sdc_track, 0);
  EXPECT_EQ(read_json(old.text(R"(,"is_sdc":true)")).sdc_track, 1);
  EXPECT_EQ(read_json(OldScene{}.text(R"(,"is_sdc":1)")).sdc_track, 1);
  EXPECT_EQ(message_of([&] { read_json(old.text(R"(,"is_sdc":"yes")")); }),
            "scene.json: objects[1].is_sdc: expected true or false, got string");
}

TEST(GpuDrive, IndicesOfDroppedTracksAreLeftOut) {
  LoggedScene scene = test::make_fixture({.num_steps = 3});
  scene.sdc_track = 80;
  scene.predictions[1].first = 90;
  const Scenario read = read_json(test::write_gpudrive(scene));
  EXPECT_EQ(read.sdc_track, -1);
  EXPECT_EQ(read.tracks_to_predict.size(), 1u);
  ASSERT_EQ(read.notes.size(), 1u);
  EXPECT_EQ(read.notes[0].count, 2);
  EXPECT_EQ(read.notes[0].first, "sdc_track_index");
}

TEST(PufferDrive, EveryLayoutIsReadAsWritten) {
  const LoggedScene fixture = test::make_fixture();
  const Scenario expected = make_scenario(fixture);
  for (const PufferLayout layout : kLayouts) {
    const Scenario read = read_binary(test::write_pufferdrive(fixture, layout));
    SCOPED_TRACE(read.format);
    expect_same_tracks(read, expected, 1e-3);  // float kilometres from the origin
    EXPECT_EQ(read.format, layout == PufferLayout::v1    ? "pufferdrive v1"
                           : layout == PufferLayout::v3c ? "pufferdrive v3c"
                                                         : "pufferdrive v2");
    EXPECT_EQ(read.id, layout == PufferLayout::v1 || layout == PufferLayout::v2 ? "" : fixture.id);
    EXPECT_EQ(read.sdc_track, layout == PufferLayout::v1 ? -1 : 0);
    EXPECT_EQ(read.tracks_to_predict.size(), layout == PufferLayout::v1 ? 0u : 2u);
    EXPECT_EQ(read.map.lanes.size(), expected.map.lanes.size());
    EXPECT_EQ(read.map.crosswalks.size(), 1u);
    EXPECT_EQ(read.map.signs.size(), 1u);
    EXPECT_EQ(successors_of(read.map), successors_of(expected.map));
    EXPECT_EQ(read.lights.size(), layout == PufferLayout::v3c ? 4u : 0u) << "each with a line of its own";
  }
}

TEST(PufferDrive, StopSignsWithoutPointsAreLeftOutWithANote) {
  LoggedScene fixture = test::make_fixture({.num_steps = 3, .num_vehicles = 1});
  const auto read_without = [&](int points) {
    std::string bytes = test::write_pufferdrive(fixture, PufferLayout::v1);
    // Type, then number of points, of the only stop sign.
    const int32_t sign[]{7, 1}, changed[]{7, points};
    const std::size_t at = bytes.rfind({reinterpret_cast<const char*>(sign), sizeof sign});
    std::memcpy(bytes.data() + at, changed, sizeof changed);
    if (points == 0) bytes.erase(at + sizeof sign, 3 * sizeof(float));
    return read_binary(bytes);
  };
  EXPECT_EQ(read_without(1).map.signs.size(), 1u);
  const Scenario scene = read_without(0);
  EXPECT_EQ(scene.map.signs.size(), 0u);
  EXPECT_THAT(notes_of(scene), ::testing::ElementsAre("1 stop signs without a point left out"));
}

TEST(PufferDrive, NewestLayoutHasLimitsLightsAndTails) {
  const LoggedScene fixture = test::make_fixture();
  const Scenario plain = read_binary(test::write_pufferdrive(fixture, PufferLayout::v3c));
  EXPECT_FLOAT_EQ(plain.map.lanes[0].speed_limit_mps, 25 * 0.44704f);
  EXPECT_FLOAT_EQ(plain.map.lanes[1].speed_limit_mps, 15.0f);
  EXPECT_FLOAT_EQ(plain.map.lane_points[0].width_m, 3.5f);
  EXPECT_EQ(plain.states_of_light(0)[0], RecordedLightState::none);
  EXPECT_EQ(plain.states_of_light(0)[20], RecordedLightState::stop);
  EXPECT_EQ(plain.states_of_light(0)[90], RecordedLightState::go);
  const Scenario tails = read_binary(test::write_pufferdrive_tails(fixture, 3.0f));
  EXPECT_FLOAT_EQ(tails.map.lane_points[0].width_m, 3.0f);
}

TEST(PufferDrive, BytesBeyondTheEndAndMissingOnesAreRefused) {
  const LoggedScene fixture = test::make_fixture({.num_steps = 2, .num_vehicles = 1, .num_pedestrians = 1});
  for (const PufferLayout layout : kLayouts) {
    const std::string bytes = test::write_pufferdrive(fixture, layout);
    ASSERT_EQ(message_of([&] { read_binary(bytes); }), test::kNoError);
    EXPECT_THAT(message_of([&] { read_binary(bytes + "x"); }),
                AllOf(HasSubstr("scene.bin: expected a PufferDrive scene of layout v1, v2 or v3c"),
                      HasSubstr("as v1: "), HasSubstr("as v2: "), HasSubstr("as v3c: ")));
    for (std::size_t length = 0; length < bytes.size(); length += 997) {
      ASSERT_THAT(message_of([&] { read_binary(bytes.substr(0, length)); }), HasSubstr("scene.bin: expected"))
          << length;
    }
  }
  EXPECT_THAT(message_of([&] { read_binary(""); }),
              HasSubstr("as v1: n_objects: expected 4 bytes, got the remaining 0"));
}

TEST(SceneFiles, FileNamesDetermineFormats) {
  EXPECT_THAT(
      message_of([] { parse_scenario_file("", "scene.txt"); }),
      HasSubstr(
          "scene.txt: expected a scene: FILE.json, FILE.bin, FILE.scenario or a file with .tfrecord in its name"));
  // A file of another format is refused by the format of its ending.
  const LoggedScene fixture = test::make_fixture({.num_steps = 2});
  EXPECT_THAT(message_of([&] { read_binary(test::write_gpudrive(fixture)); }),
              HasSubstr("scene.bin: expected a Puffer"));
  EXPECT_THAT(message_of([&] { read_json(test::write_pufferdrive(fixture, PufferLayout::v1)); }),
              HasSubstr("scene.json: expected JSON"));
}

}  // namespace
}  // namespace pictura
