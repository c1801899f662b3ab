// Rules for converting a recording to a scenario; docs/reference/scenario.md lists the rules. Each rule is tested in a
// case whose result depends on it.
#include <cmath>
#include <filesystem>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scene_cache.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scene_fixture.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using Eigen::Vector3d;
using test::message_of;
using ::testing::HasSubstr;

/// One straight lane along x with a track on it.
LoggedScene small_scene() {
  LoggedScene scene;
  scene.source = "small";
  scene.num_steps = 2;
  LoggedTrack track{.id = 5, .type = TrackType::vehicle};
  track.states.assign(2, {.length_m = 4, .width_m = 2, .height_m = 1.5, .valid = true});
  scene.tracks = {track};
  scene.lanes = {{.id = 1, .type = LoggedLaneType::surface}};
  for (int i = 0; i <= 40; ++i) scene.lanes[0].points.emplace_back(0.5 * i, 0, 0);
  return scene;
}

LoggedLane lane_at(int64_t id, double y, double x0 = 0, double x1 = 20) {
  LoggedLane lane{.id = id, .type = LoggedLaneType::surface};
  for (int i = 0; i <= 40; ++i) lane.points.emplace_back(x0 + (x1 - x0) * i / 40, y, 0);
  return lane;
}

LoggedPoints line_at(double y, double x0 = 0, double x1 = 20) { return lane_at(0, y, x0, x1).points; }

int count_of(const Scenario& scenario, const std::string& what) {
  for (const ConversionNote& note : scenario.notes) {
    if (note.what.find(what) != std::string::npos) return note.count;
  }
  return 0;
}

TEST(LaneRules, PiecesAreLongWhereLanesAreStraight) {
  const Scenario scenario = make_scenario(small_scene());
  ASSERT_EQ(scenario.map.lanes.size(), 1u);
  EXPECT_EQ(scenario.map.lanes[0].points.size(), 3) << "20 m in pieces of at most 10 m";
  EXPECT_NEAR(scenario.map.lanes[0].length_m, 20, 1e-4);
  EXPECT_EQ(scenario.map.origin_m[0], 10);
}

TEST(LaneRules, WidthsComeFromBordersThenNeighborsThenAConstant) {
  LoggedScene scene = small_scene();
  const auto width = [&] { return make_scenario(scene).map.lane_points[0].width_m; };
  EXPECT_FLOAT_EQ(width(), 3.5f);
  // One known side counts twice; two known sides are summed.
  scene.lines.push_back({.id = 8, .points = line_at(1.5)});
  scene.lanes[0].left_boundaries = {{0, 40, 8}};
  EXPECT_FLOAT_EQ(width(), 3.0f);
  scene.edges.push_back({.id = 9, .points = line_at(-2)});
  scene.lanes[0].right_boundaries = {{0, 40, 9}};
  EXPECT_FLOAT_EQ(width(), 3.5f);
  // A border that is too far away belongs to another lane.
  scene.edges[0].points = line_at(-7);
  EXPECT_FLOAT_EQ(width(), 3.0f);
  // Without borders of its own: the neighbour's width.
  scene.lanes.insert(scene.lanes.begin(), lane_at(2, -3));
  scene.lanes[0].left_neighbors = {{0, 40, 1}};
  EXPECT_FLOAT_EQ(width(), 3.0f);
  // Without a neighbour: the width of the lanes before and after.
  scene.lanes[0].left_neighbors.clear();
  scene.lanes[0].exits = {1};
  EXPECT_FLOAT_EQ(width(), 3.0f);
  scene.lanes[0].exits.clear();
  EXPECT_FLOAT_EQ(width(), 3.5f);
  scene.lanes[0].type = LoggedLaneType::bike;
  EXPECT_FLOAT_EQ(width(), 1.8f);
  // Points outside the border's range are interpolated.
  scene.lanes.erase(scene.lanes.begin());
  scene.lanes[0].left_boundaries = {{0, 0, 8}, {40, 40, 8}};
  scene.lines[0].points = {{0, 1, 0}, {20, 2, 0}};
  const Scenario tapered = make_scenario(scene);
  EXPECT_NEAR(tapered.map.lane_points[0].width_m, 2, 2e-2);
  EXPECT_NEAR(tapered.map.lane_points[2].width_m, 4, 2e-2);
}

TEST(LaneRules, FaultyLanesAndLinksAreRepairedAndCounted) {
  LoggedScene scene = small_scene();
  scene.lanes.push_back(lane_at(2, 0, 20, 40));
  scene.lanes.push_back({.id = 3, .type = LoggedLaneType::surface, .points = {{1, 1, 0}}});
  // Stated in reverse: lane 2 begins where lane 1 ends.
  scene.lanes[1].exits = {1, 77, 2};
  scene.lanes[0].points.insert(scene.lanes[0].points.begin() + 3, scene.lanes[0].points[3]);
  const Scenario scenario = make_scenario(scene);
  ASSERT_EQ(scenario.map.lanes.size(), 2u);
  EXPECT_EQ(count_of(scenario, "fewer than two points"), 1);
  EXPECT_EQ(count_of(scenario, "repeat the one before"), 1);
  EXPECT_EQ(count_of(scenario, "links to lanes that the map does not have"), 1);
  EXPECT_EQ(count_of(scenario, "links of a lane to itself"), 1);
  EXPECT_EQ(count_of(scenario, "the other way round"), 1);
  ASSERT_EQ(scenario.map.lanes[0].successors.size(), 1);
  EXPECT_EQ(scenario.map.links(scenario.map.lanes[0].successors)[0], 1);
  EXPECT_EQ(scenario.map.lanes[1].successors.size(), 0);
}

// Thinning such a line leaves two equal points.
TEST(LaneRules, LinesThatReturnWithinTheToleranceAreLeftOutWithANote) {
  LoggedScene scene = small_scene();
  const LoggedPoints there_and_back{{3, 3, 0}, {3.015, 3, 0}, {3, 3, 0}};
  scene.lanes.push_back({.id = 2, .type = LoggedLaneType::surface, .points = there_and_back});
  scene.lines.push_back({.id = 3, .points = there_and_back});
  scene.lines.push_back({.id = 4, .points = {{0, 0, 0}}});
  scene.edges.push_back({.id = 5, .points = there_and_back});
  scene.edges.push_back({.id = 6});
  const Scenario scenario = make_scenario(scene);
  EXPECT_EQ(scenario.map.lanes.size(), 1u);
  EXPECT_EQ(scenario.map.markings.size(), 0u);
  EXPECT_EQ(scenario.map.road_edges.size(), 0u);
  EXPECT_EQ(count_of(scenario, "lanes of fewer than two points"), 1);
  EXPECT_EQ(count_of(scenario, "road lines of fewer than two points"), 2);
  EXPECT_EQ(count_of(scenario, "edges of fewer than two points"), 2);
}

TEST(LaneRules, TypesOfUndefinedLanesFollowTheirLinks) {
  LoggedScene scene = small_scene();
  scene.lanes.push_back(lane_at(2, 0, 20, 40));
  scene.lanes[1].type = LoggedLaneType::undefined;
  EXPECT_EQ(make_scenario(scene).map.lanes[1].type, LaneType::other);
  scene.lanes[0].exits = {2};
  EXPECT_EQ(make_scenario(scene).map.lanes[1].type, LaneType::driving);
  scene.lanes[0].type = LoggedLaneType::bike;
  EXPECT_EQ(make_scenario(scene).map.lanes[1].type, LaneType::biking);
}

TEST(LaneRules, LinksOfALaneToItselfAreCountedOnce) {
  LoggedScene scene = small_scene();
  scene.lanes[0].entries = scene.lanes[0].exits = {1};
  EXPECT_EQ(count_of(make_scenario(scene), "links of a lane to itself"), 1);
}

TEST(LaneRules, NeighborsAreMutualAndTheLongest) {
  LoggedScene scene = small_scene();
  scene.lanes.push_back(lane_at(2, 3.5));
  scene.lanes.push_back(lane_at(3, 3.6));
  scene.lanes[0].left_neighbors = {{0, 5, 3}, {6, 40, 2}};
  EXPECT_EQ(make_scenario(scene).map.lanes[0].left_neighbor, -1) << "lane 2 does not name it";
  scene.lanes[1].right_neighbors = {{0, 40, 1}};
  scene.lanes[2].right_neighbors = {{0, 5, 1}};
  Scenario scenario = make_scenario(scene);
  EXPECT_EQ(scenario.map.lanes[0].left_neighbor, 1);
  EXPECT_EQ(scenario.map.lanes[1].right_neighbor, 0);
  EXPECT_EQ(scenario.map.lanes[2].right_neighbor, -1);
  // A ring has no leftmost lane, so one of its links is omitted.
  scene.lanes[0].left_neighbors = {{0, 40, 2}};
  scene.lanes[1].left_neighbors = {{0, 40, 1}};
  scene.lanes[0].right_neighbors = {{0, 40, 2}};
  scenario = make_scenario(scene);
  EXPECT_EQ((scenario.map.lanes[0].left_neighbor >= 0) + (scenario.map.lanes[1].left_neighbor >= 0), 1);
}

TEST(LaneRules, CrossingLanesFormAJunction) {
  LoggedScene scene = small_scene();
  LoggedLane across{.id = 2, .type = LoggedLaneType::surface};
  for (int i = -20; i <= 20; ++i) across.points.emplace_back(10, 0.5 * i, 0);
  scene.lanes.push_back(across);
  Scenario scenario = make_scenario(scene);
  EXPECT_TRUE(scenario.map.lanes[0].in_junction && scenario.map.lanes[1].in_junction);
  ASSERT_EQ(scenario.map.junctions.size(), 1u);
  for (Vector3d& p : scene.lanes[1].points) p.z() = 5;  // a bridge
  scenario = make_scenario(scene);
  EXPECT_FALSE(scenario.map.lanes[0].in_junction);
  EXPECT_EQ(scenario.map.junctions.size(), 0u);
}

TEST(EdgeRules, EdgesAreTurnedToHaveTheRoadOnTheirRight) {
  LoggedScene scene = small_scene();
  scene.edges.push_back({.id = 9, .points = line_at(-2)});  // the lane is on its left
  Scenario scenario = make_scenario(scene);
  ASSERT_EQ(scenario.map.road_edges.size(), 2u);
  EXPECT_GT(scenario.map.road_edges[0].a_m.x, scenario.map.road_edges[0].b_m.x);
  EXPECT_EQ(count_of(scenario, "road on their right"), 0);
  // A file whose edges have the road on the other side, according to most of them.
  scene.edges.clear();
  for (int i = 0; i < 20; ++i) scene.edges.push_back({.id = 10 + i, .points = line_at(2.0 + 0.01 * i)});
  scenario = make_scenario(scene);
  EXPECT_LT(scenario.map.road_edges[0].a_m.x, scenario.map.road_edges[0].b_m.x);
  EXPECT_EQ(count_of(scenario, "road on their right"), 1);
}

TEST(EdgeRules, GapsStayClosedUnlessTheyCrossALane) {
  LoggedScene scene = small_scene();
  // Along the lane's right side, then a jump of 8 m along it, then a jump across.
  scene.edges.push_back({.id = 9, .points = {{0, -2, 0}, {1, -2, 0}, {9, -2, 0}, {9, 4, 0}, {10, 4, 0}}});
  const Scenario scenario = make_scenario(scene);
  EXPECT_EQ(count_of(scenario, "gaps of edges across lanes"), 1);
  double length_m = 0;
  for (const RoadEdge& edge : scenario.map.road_edges) length_m += double{length(edge.b_m - edge.a_m)};
  EXPECT_NEAR(length_m, 10, 1e-3);
}

TEST(PaintRules, StripesAndDashes) {
  LoggedScene scene = small_scene();
  const auto markings = [&](LoggedLineType type, double length_m) {
    scene.lines = {{.id = 3, .type = type, .points = {{0, 0, 0}, {length_m, 0, 0}}}};
    return make_scenario(scene).map.markings;
  };
  EXPECT_EQ(markings(LoggedLineType::solid_single_white, 9).size(), 1u);
  EXPECT_EQ(markings(LoggedLineType::unknown, 9).size(), 1u);
  EXPECT_EQ(markings(LoggedLineType::solid_double_yellow, 9).size(), 2u);
  EXPECT_EQ(markings(LoggedLineType::broken_single_white, 51).size(), 5u);
  EXPECT_EQ(markings(LoggedLineType::broken_single_white, 2).size(), 1u);
  EXPECT_EQ(markings(LoggedLineType::broken_double_yellow, 51).size(), 10u);
  const std::vector<Marking> passing = markings(LoggedLineType::passing_double_yellow, 51);
  EXPECT_EQ(passing.size(), 6u);
  EXPECT_FALSE(passing[0].broken);
  EXPECT_TRUE(passing[1].broken);
  EXPECT_EQ(passing[1].color, MarkColor::yellow);
  // Dashes of 3 m every 12 m.
  scene.lines = {{.id = 3, .type = LoggedLineType::broken_single_white, .points = {{0, 0, 0}, {51, 0, 0}}}};
  const Scenario scenario = make_scenario(scene);
  const auto at = [&](std::size_t i) { return scenario.map.marking_points[i]; };
  EXPECT_NEAR(at(1).x - at(0).x, 3, 1e-4);
  EXPECT_NEAR(at(2).x - at(0).x, 12, 1e-4);
}

TEST(LightRules, LanesOfOneStopPointWithEqualStatesAreOneLight) {
  const LoggedScene fixture = test::make_fixture();
  const Scenario scenario = make_scenario(fixture);
  // Arm 0's right turn has its own arrow; arm 2's two lanes always have the same state.
  ASSERT_EQ(scenario.lights.size(), 3u);
  EXPECT_EQ(scenario.lights[1].lanes.size(), 2);
  const RecordedLight& light = scenario.lights[0];
  const Vec3 way = light.stop_b_m - light.stop_a_m;
  EXPECT_NEAR(length(way), 3.5, 1e-3) << "across the lane";
  EXPECT_NEAR(std::abs(light.stop_heading_rad), kPi, 1e-4);
  EXPECT_GT(way.y, 0) << "traffic comes westwards, so the left end is the southern one";
}

TEST(LightRules, LightsStopLanesThatBeginWithoutWidthAtTheirStart) {
  LoggedScene scene = small_scene();
  scene.lanes[0].widths_m.assign(scene.lanes[0].points.size(), 3.5);
  scene.lanes[0].widths_m[0] = 0;
  scene.lights = {{.lanes = {1}, .states = {RecordedLightState::stop, RecordedLightState::go}},
                  {.states = {RecordedLightState::stop, RecordedLightState::go}}};
  const Scenario scenario = make_scenario(scene);
  ASSERT_EQ(scenario.lights.size(), 1u);
  EXPECT_EQ(scenario.lights[0].stop_a_m.x, -10);
  EXPECT_EQ(scenario.lights[0].stop_a_m.y, 0.5f);
  EXPECT_EQ(scenario.lights[0].stop_b_m.y, -0.5f);
  EXPECT_EQ(count_of(scenario, "lights without lanes"), 1);
}

TEST(TrackRules, SizesAreThoseOfTheCurrentStep) {
  LoggedScene scene = small_scene();
  scene.current_step = 1;
  scene.tracks[0].states[0].length_m = 9;
  scene.tracks[0].states[1].height_m = 3;
  scene.tracks[0].states[1].center_m.z() = 2;
  scene.tracks[0].states[1].heading_rad = 4;
  const Scenario scenario = make_scenario(scene);
  EXPECT_EQ(scenario.tracks[0].length_m, 4);
  EXPECT_EQ(scenario.states[0].position_m.z, -0.75f);
  EXPECT_EQ(scenario.states[1].position_m.z, 0.5f);
  EXPECT_NEAR(scenario.states[1].heading_rad, 4 - 2 * kPi, 1e-6);
  // The last valid state counts if the track is absent at the current step.
  for (size_t step = 1; step < scene.tracks[0].states.size(); ++step) scene.tracks[0].states[step].valid = false;
  EXPECT_EQ(make_scenario(scene).tracks[0].length_m, 9);
}

TEST(TrackRules, TracksWithoutValidStatesAreLeftOut) {
  LoggedScene scene = small_scene();
  scene.tracks.insert(scene.tracks.begin(), scene.tracks[0]);
  for (LoggedState& state : scene.tracks[0].states) state.valid = false;
  scene.sdc_track = 1;
  scene.predictions = {{0, 0}, {1, 0}};
  const Scenario scenario = make_scenario(scene);
  EXPECT_EQ(scenario.tracks.size(), 1u);
  EXPECT_EQ(scenario.sdc_track, 0);
  ASSERT_EQ(scenario.tracks_to_predict.size(), 1u);
  EXPECT_EQ(scenario.tracks_to_predict[0].track, 0);
  EXPECT_EQ(count_of(scenario, "tracks without a valid state"), 1);
}

// The drivable area
// ----------------------------------------------------------------------------------------------------

/// A square road of 20 m with a square hole of 4 m in its middle.
RoadMap ring_road() {
  RoadMap map;
  const auto ring = [&](float half_m, bool clockwise) {
    std::vector<Vec3> corners{{half_m, half_m, 0}, {half_m, -half_m, 0}, {-half_m, -half_m, 0}, {-half_m, half_m, 0}};
    if (!clockwise) std::reverse(corners.begin(), corners.end());
    for (std::size_t i = 0; i < 4; ++i) map.road_edges.push_back({corners[i], corners[(i + 1) % 4]});
  };
  ring(10, true);
  ring(2, false);
  return map;
}

TEST(DrivableArea, SidesAtEdgesAndCorners) {
  const DrivableArea area(ring_road());
  EXPECT_TRUE(area.side_of({5, 0, 0}).is_on_road);
  EXPECT_TRUE(area.side_of({9.9f, 9.9f, 0}).is_on_road);
  EXPECT_FALSE(area.side_of({10.1f, 0, 0}).is_on_road);
  // Beyond corners, where the side of only one of the two edges would be wrong.
  EXPECT_FALSE(area.side_of({11, 10.5f, 0}).is_on_road);
  EXPECT_FALSE(area.side_of({10.5f, 11, 0}).is_on_road);
  EXPECT_FALSE(area.side_of({1.9f, 0, 0}).is_on_road);
  EXPECT_TRUE(area.side_of({2.3f, 2.6f, 0}).is_on_road);
  EXPECT_TRUE(area.side_of({2.6f, 2.3f, 0}).is_on_road);
  EXPECT_NEAR(area.side_of({5, 0, 0}).distance_m, 3, 1e-4);
  EXPECT_EQ(area.side_of({500, 0, 0}).edge, -1);
}

TEST(DrivableArea, BoxesTouchEdgesOnTheirLevel) {
  const DrivableArea area(ring_road());
  EXPECT_FALSE(area.touches_edge({{6, 0, 0}, 0, 4, 2}));
  EXPECT_TRUE(area.touches_edge({{8.5f, 0, 0}, 0, 4, 2}));
  EXPECT_FALSE(area.touches_edge({{8.5f, 0, 0}, kPi / 2, 4, 2}));
  EXPECT_FALSE(area.touches_edge({{8.5f, 0, 5}, 0, 4, 2}));
  // A small edge inside a large box.
  RoadMap map;
  map.road_edges.push_back({{0, 0, 0}, {0.1f, 0, 0}});
  EXPECT_TRUE(DrivableArea(map).touches_edge({{0.5f, 0.2f, 0}, 1, 4, 2}));
}

TEST(DrivableArea, TheFixturesTrafficStaysOnItsRoad) {
  const Scenario scenario = make_scenario(test::make_fixture());
  const LoggedDriving driving = logged_driving(scenario);
  EXPECT_GT(driving.vehicle_steps, 300);
  EXPECT_EQ(driving.touching, 0);
  EXPECT_EQ(driving.off_road, 0);
  // Moved by 3 m to the side, traffic does not agree with the edges.
  LoggedScene moved = test::make_fixture();
  for (LoggedTrack& track : moved.tracks) {
    for (LoggedState& state : track.states) state.center_m.y() += 3;
  }
  const LoggedDriving beside = logged_driving(make_scenario(moved));
  EXPECT_GT(beside.off_road + beside.touching, beside.vehicle_steps / 4);
}

// The cache
// ------------------------------------------------------------------------------------------------------------

constexpr SceneCacheKey kKey{.content = 0x1234, .record = 5};

TEST(SceneCache, EveryFieldIsRestored) {
  const Scenario scenario = make_scenario(test::make_fixture());
  const std::string bytes = encode_scenario(scenario, kKey);
  EXPECT_EQ(first_difference(decode_scenario(bytes, kKey, "cache"), scenario), "");
}

TEST(SceneCache, ErrorsGiveTheReasonForForeignFiles) {
  const Scenario scenario = make_scenario(small_scene());
  const std::string bytes = encode_scenario(scenario, kKey);
  const auto reason = [](const std::string& text, const SceneCacheKey& key = kKey) {
    return message_of([&] { decode_scenario(text, key, "cache"); });
  };
  ASSERT_EQ(reason(bytes), test::kNoError);
  for (std::size_t length = 0; length < bytes.size(); length += 13) {
    ASSERT_THAT(reason(bytes.substr(0, length)), HasSubstr("cache: truncated")) << length;
  }
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    ASSERT_NE(reason(damaged), test::kNoError) << at;
  }
  EXPECT_THAT(reason(bytes, {.content = 0x1235, .record = 5}), HasSubstr("stale: the scene's file has changed"));
  EXPECT_THAT(reason("PICTRMAP" + bytes.substr(8)), HasSubstr("foreign: expected it to begin with PICTRSCN"));
}

TEST(SceneCache, ScenesAndIndicesAreKeptUntilTheirFileChanges) {
  const test::ScratchFolder folder, cache;
  const test::EnvironmentVariable on("PICTURA_CACHE", std::nullopt), home("XDG_CACHE_HOME", cache.path());
  const std::string shard = folder / "some.tfrecord";
  const auto record = [](uint64_t seed) {
    return test::write_womd(test::make_fixture({.seed = seed, .num_steps = 3}));
  };
  write_file(shard, test::write_tfrecord({record(1), record(2)}));
  SceneReport report;
  const Scenario first = load_scenario(shard + "#1", &report);
  EXPECT_FALSE(report.cached);
  const Scenario again = load_scenario(shard + "#1", &report);
  EXPECT_TRUE(report.cached);
  EXPECT_EQ(first_difference(first, again), "");
  load_scenario(shard + "#0", &report);
  EXPECT_FALSE(report.cached);
  write_file(shard, test::write_tfrecord({record(1), record(3), record(4)}));
  EXPECT_EQ(load_scenario(shard + "#1", &report).id, "fixture00000003");
  EXPECT_FALSE(report.cached);
  EXPECT_THAT(report.cache_rejection, HasSubstr("stale"));
  EXPECT_EQ(load_scenario(shard + "#2").id, "fixture00000004");
}

TEST(SceneCache, ScenesAreCalledAsTheLinkThatIsRead) {
  const test::ScratchFolder folder, cache;
  const test::EnvironmentVariable on("PICTURA_CACHE", std::nullopt), home("XDG_CACHE_HOME", cache.path());
  write_file(folder / "a.json", test::write_gpudrive(test::make_fixture({.num_steps = 3})));
  std::filesystem::create_symlink(folder / "a.json", folder / "b.json");
  SceneReport report;
  EXPECT_EQ(load_scenario(folder / "a.json").map.name, "a");
  EXPECT_EQ(load_scenario(folder / "b.json", &report).map.name, "b");
  EXPECT_TRUE(report.cached);
}

TEST(SceneCache, ChangedBytesOfEqualSizeAndTimeAreDetected) {
  const test::ScratchFolder folder, cache;
  const test::EnvironmentVariable on("PICTURA_CACHE", std::nullopt), home("XDG_CACHE_HOME", cache.path());
  const std::string shard = folder / "some.tfrecord";
  const auto write = [&](uint64_t seed) {
    write_file(shard, test::write_tfrecord({test::write_womd(test::make_fixture({.seed = seed, .num_steps = 3}))}));
  };
  write(1);
  const auto time = std::filesystem::last_write_time(shard);
  const auto bytes = std::filesystem::file_size(shard);
  EXPECT_EQ(load_scenario(shard).id, "fixture00000001");
  write(2);
  std::filesystem::last_write_time(shard, time);
  ASSERT_EQ(std::filesystem::file_size(shard), bytes);
  EXPECT_EQ(find_scene(shard).id, "fixture00000002");
  EXPECT_EQ(load_scenario(shard + "#fixture00000002").id, "fixture00000002");
}

/// Converts the scene that a scenario states; the conversion must add no notes.
Scenario stated_again(const Scenario& scenario) {
  Scenario again = make_scenario(scene_of_scenario(scenario));
  again.notes.clear();
  return again;
}

TEST(AuthoredScenes, AuthoredValuesAreNotRepaired) {
  LoggedScene scene = small_scene();
  scene.is_authored = true;
  scene.tolerance_m = 0.01;
  scene.lanes.push_back(lane_at(2, 0, 40, 20));
  scene.lanes.push_back(lane_at(3, 0, 40, 60));
  scene.lanes[2].type = LoggedLaneType::undefined;
  // Reversed, and over a gap; the type of lane 3 is unknown.
  scene.lanes[1].exits = {1};
  scene.lanes[0].exits = {3};
  // The road on the right, and a gap of 10 m across the first lane.
  scene.edges = {{.id = 4, .points = line_at(1, 0, 40)}, {.id = 5, .points = {{5, -5, 0}, {5, 5, 0}}}};
  LoggedLight light{.lanes = {1}, .states = {RecordedLightState::stop, RecordedLightState::go}};
  scene.lights = {light, light};
  const Scenario scenario = make_scenario(scene);
  EXPECT_THAT(scenario.notes, ::testing::ElementsAre(::testing::Field(&ConversionNote::what, HasSubstr("over a gap"))));
  EXPECT_EQ(scenario.map.links(scenario.map.lanes[1].successors)[0], 0);
  EXPECT_EQ(scenario.map.lanes[2].type, LaneType::other);
  EXPECT_EQ(scenario.lights.size(), 2u);
  EXPECT_EQ(scenario.map.road_edges.front().a_m.x - scenario.map.road_edges.front().b_m.x, 10);
  EXPECT_EQ(scenario.map.road_edges.back().b_m.y, -5);
  EXPECT_EQ(scenario.states[0].position_m.z, 0) << "the foot's";
  scene.edges[0].points = line_at(1, 0, 400);
  scene.lanes[0].points = line_at(0, 0, 400);
  EXPECT_EQ(count_of(make_scenario(scene), "though the road is stated to be on their left"), 1);
}

TEST(AuthoredScenes, ReadBackBitwiseIdentical) {
  LoggedScene scene = test::make_fixture();
  scene.is_authored = true;
  scene.tolerance_m = 0.01;
  for (std::size_t i = 0; i < scene.stop_signs.size(); ++i) scene.stop_signs[i].id = static_cast<int64_t>(i);
  Scenario first = make_scenario(scene);
  first.notes.clear();
  const Scenario second = stated_again(first);
  EXPECT_EQ(first_difference(second, first), "");
  EXPECT_GT(second.lights.size(), 0u);
}

// Pieces, dashes and duplicates are near their limits everywhere on a winding map far from its origin.
TEST(AuthoredScenes, ReadBackBitwiseIdenticalFarFromTheOrigin) {
  for (const double away_m : {0.0, 3000.0, 9000.0}) {
    LoggedScene scene = small_scene();
    scene.is_authored = true;
    scene.origin_m = Vector3d(0.1, 1e6 + 0.3, 7.7);
    scene.lanes[0].points.clear();
    for (int i = 0; i < 400; ++i) {
      const double angle = 0.02 * i, step = i % 7 == 0 ? 0.01 : i % 11 == 0 ? 20.0 : 2.5;
      const Vector3d last = i > 0 ? scene.lanes[0].points.back() : Vector3d(away_m, 1e6 - away_m, 1e-7 * i);
      scene.lanes[0].points.emplace_back(last + step * Vector3d(std::cos(angle), std::sin(angle), 1e-3));
    }
    scene.lanes[0].widths_m.assign(400, 3.3);
    scene.lanes[0].widths_m[17] = 3.9;
    for (LoggedState& state : scene.tracks[0].states) {
      state.center_m = scene.lanes[0].points[3];
      state.heading_rad = std::numbers::pi;
    }
    scene.edges = {{.id = 1, .points = scene.lanes[0].points}};
    for (int type = 0; type <= static_cast<int>(LoggedLineType::dash_yellow); ++type) {
      scene.lines.push_back({.id = type, .type = static_cast<LoggedLineType>(type), .points = scene.lanes[0].points});
    }
    for (const double tolerance_m : {0.0, 0.01}) {
      scene.tolerance_m = tolerance_m;
      Scenario first = make_scenario(scene);
      first.notes.clear();
      EXPECT_EQ(first_difference(first, stated_again(first)), "") << away_m << ' ' << tolerance_m;
      EXPECT_NEAR(first.states[0].heading_rad, kPi, 1e-6);
    }
  }
}

TEST(AuthoredScenes, ObjectsOfInterestStayWhereIdsRepeat) {
  LoggedScene scene = small_scene();
  scene.tracks.push_back(scene.tracks[0]);
  scene.objects_of_interest = {5};
  Scenario scenario = make_scenario(scene);
  scenario.objects_of_interest = {1};
  EXPECT_THAT(stated_again(scenario).objects_of_interest, ::testing::ElementsAre(1));
}

TEST(AuthoredScenes, RecordingsKeepTheirTracksLinksAndLights) {
  Scenario recorded = make_scenario(test::make_fixture());
  Scenario stated = stated_again(recorded);
  EXPECT_EQ(first_difference(stated_again(stated), stated), "");
  // Directions of lines are computed from points that are now rounded.
  ASSERT_EQ(stated.lights.size(), recorded.lights.size());
  for (std::size_t i = 0; i < stated.lights.size(); ++i) {
    EXPECT_NEAR(stated.lights[i].stop_heading_rad, recorded.lights[i].stop_heading_rad, 1e-4);
    stated.lights[i].stop_heading_rad = recorded.lights[i].stop_heading_rad;
  }
  ASSERT_EQ(stated.map.lane_points.size(), recorded.map.lane_points.size());
  for (std::size_t i = 0; i < stated.map.lane_points.size(); ++i) {
    EXPECT_LT(length(stated.map.lane_points[i].position_m - recorded.map.lane_points[i].position_m), 1e-4f);
  }
  EXPECT_EQ(stated.map.lane_links, recorded.map.lane_links);
  EXPECT_EQ(stated.map.markings.size(), recorded.map.markings.size());
  EXPECT_EQ(stated.map.road_edges.size(), recorded.map.road_edges.size());
  EXPECT_EQ(stated.map.crosswalks.size(), recorded.map.crosswalks.size());
  EXPECT_EQ(stated.map.signs.size(), recorded.map.signs.size());
  stated.map = recorded.map;
  recorded.notes.clear();
  EXPECT_EQ(first_difference(stated, recorded), "");
}

}  // namespace
}  // namespace pictura
