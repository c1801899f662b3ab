// Pictures and videos: single pixels, sizes and files.
#include "pictura/drawing/drawing.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/drawing/film.h"
#include "pictura/drawing/planes.h"
#include "pictura/drawing/ticks.h"
#include "pictura/drawing/video.h"
#include "pictura/drawing/world.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/procedural/procedural_town.h"
#include "pictura/tests/map/small_roads.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

namespace fs = std::filesystem;
using test::EnvironmentVariable;
using test::ScratchFolder;
using testing::HasSubstr;

struct Pixel {
  int r, g, b;
  bool operator==(const Pixel&) const = default;
};
void PrintTo(const Pixel& p, std::ostream* out) { *out << "(" << p.r << ", " << p.g << ", " << p.b << ")"; }

Pixel at(const RgbImage& image, int x, int y) {
  const uint8_t* p = &image.rgb[3 * (y * image.width_px + x)];
  return {p[0], p[1], p[2]};
}
Pixel at(const RgbImage& image, Vec2 p) { return at(image, static_cast<int>(p.x), static_cast<int>(p.y)); }

/// Returns the maximum difference of a channel.
int distance(Pixel a, Pixel b) { return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)}); }

int count(const RgbImage& image, Pixel wanted) {
  int found = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) found += at(image, x, y) == wanted;
  }
  return found;
}

// Colours of the palette: a vehicle's back and front, and a cyclist's back.
constexpr Pixel kVehicleBody{76, 201, 240}, kVehicleMark{247, 37, 133}, kCyclistBody{251, 133, 0};
constexpr Pixel kGround{238, 240, 232};

const RoadMap& town() {
  static const RoadMap map = parse_opendrive(procedural_town({3, 2, 2}), "town");
  return map;
}

AgentBox box(float x, float y, float heading, AgentClass agent_class = AgentClass::vehicle) {
  AgentBox agent;
  agent.center_m = {x, y, 0};
  agent.cos_heading = std::cos(heading);
  agent.sin_heading = std::sin(heading);
  agent.length_m = 5;
  agent.width_m = 2;
  agent.height_m = 1.5f;
  agent.agent_class = agent_class;
  return agent;
}

TEST(WorldPainter, DrawsABoxAtItsPosition) {
  WorldPainter painter(town(), 400, 300);
  const std::vector<AgentBox> agents{box(500, 400, 0)};  // away from all roads
  WorldFrame frame;
  frame.agents = agents;
  // 10 px a metre, the box's centre in the middle of the picture.
  const RgbImage image = painter.draw(frame, painter.around({500, 400}, 40));
  ASSERT_EQ(image.width_px, 400);
  ASSERT_EQ(image.height_px, 300);
  EXPECT_EQ(at(image, 200 - 15, 150), kVehicleBody);
  EXPECT_EQ(at(image, 200 + 12, 150), kVehicleMark);
  for (const int x : {200 - 27, 200 + 27}) EXPECT_EQ(at(image, x, 150), kGround);
  for (const int y : {150 - 12, 150 + 12}) EXPECT_EQ(at(image, 190, y), kGround);
  // 5 m x 2 m at 10 px a metre, and the outline's half pixel on either side.
  int long_px = 0, wide_px = 0;
  for (int x = 0; x < 400; ++x) long_px += at(image, x, 150) != kGround;
  for (int y = 0; y < 300; ++y) wide_px += at(image, 190, y) != kGround;
  EXPECT_NEAR(long_px, 50, 2);
  EXPECT_NEAR(wide_px, 20, 2);
}

TEST(WorldPainter, MarksCoverEarlierDrawing) {
  WorldPainter painter(town(), 300, 300);
  const std::vector<AgentBox> agents{box(500, 400, 0)};
  const std::vector<WorldMark> marks{{{499, 400}, rgb8(1, 2, 3), ""}, {{500, 404}, rgb8(4, 5, 6), "a"}};
  WorldFrame frame;
  frame.agents = agents;
  frame.marks = marks;
  const RgbImage image = painter.draw(frame, painter.around({500, 400}, 30));
  EXPECT_EQ(at(image, 140, 150), (Pixel{1, 2, 3}));
  EXPECT_EQ(at(image, 150, 110), (Pixel{4, 5, 6}));
}

TEST(WorldPainter, HeadingsAreCounterClockwiseFromEast) {
  WorldPainter painter(town(), 300, 300);
  const std::vector<AgentBox> agents{box(500, 400, kHalfPi)};
  WorldFrame frame;
  frame.agents = agents;
  const RgbImage image = painter.draw(frame, painter.around({500, 400}, 30));
  EXPECT_EQ(at(image, 150, 150 - 12), kVehicleMark);  // north is up
  EXPECT_EQ(at(image, 150, 150 + 15), kVehicleBody);
  EXPECT_EQ(at(image, 150 + 15, 150), kGround);
}

TEST(WorldPainter, PixelOfIsTheDrawnPosition) {
  WorldPainter painter(town(), 320, 200);
  const TopCamera camera = painter.around({510, 410}, 64);  // 5 px a metre
  const Vec2 p = painter.pixel_of(camera, {520, 420});
  EXPECT_NEAR(p.x, 160 + 50, 0.51);
  EXPECT_NEAR(p.y, 100 - 50, 0.51);
  const std::vector<AgentBox> agents{box(520, 420, 0, AgentClass::cyclist)};
  WorldFrame frame;
  frame.agents = agents;
  EXPECT_EQ(at(painter.draw(frame, camera), p - Vec2{6, 0}), kCyclistBody);
}

TEST(WorldPainter, SkipsAbsentAgentsAndDimsHaltedOnes) {
  WorldPainter painter(town(), 400, 300);
  std::vector<AgentBox> agents{box(500, 400, 0), box(500, 405, 0), box(500, 395, 0), box(510, 400, 0)};
  agents[3].drawn = 0;
  const std::vector<AgentStatus> status{AgentStatus::halted, AgentStatus::absent, AgentStatus::active,
                                        AgentStatus::active};
  WorldFrame frame;
  frame.agents = agents;
  frame.status = status;
  const RgbImage image = painter.draw(frame, painter.around({500, 400}, 40));
  const Pixel halted = at(image, 185, 150);
  EXPECT_NE(halted, kVehicleBody);
  EXPECT_NE(halted, kGround);
  EXPECT_EQ(at(image, 185, 100), kGround);
  EXPECT_EQ(at(image, 185, 200), kVehicleBody);
  EXPECT_EQ(at(image, 285, 150), kGround);

  for (const int hidden : {1, 3}) {
    frame.highlighted = hidden;
    EXPECT_EQ(painter.draw(frame, painter.around({500, 400}, 40)).rgb, image.rgb) << hidden;
  }

  frame.status = Span<const AgentStatus>(status).subspan(0, 3);
  EXPECT_THAT(test::message_of([&] { painter.draw(frame, painter.whole_map()); }), HasSubstr("4 agents, got 3"));
}

TEST(WorldPainter, RingsShowHaltReasonsAndTheLegendCountsThem) {
  WorldPainter painter(town(), 800, 600);
  const std::vector<AgentBox> agents{box(500, 400, 0), box(510, 400, 0), box(500, 410, 0), box(510, 410, 0)};
  const auto active = AgentStatus::active, halted = AgentStatus::halted;
  const std::vector<AgentStatus> status{halted, halted, active, halted};
  std::vector<uint8_t> reasons{kEventCollision | kEventAtFault, kEventRedLight, 0, kEventOffRoad};
  WorldFrame frame;
  frame.agents = agents;
  frame.status = status;
  frame.halt_reason = reasons;
  const TopCamera camera = painter.around({500, 400}, 80);  // 10 px a metre, rings of 30 px about boxes of 5 m
  const RgbImage image = painter.draw(frame, camera);
  const auto ring = [&](size_t agent) {
    return at(image, painter.pixel_of(camera, agents[agent].center_m.xy()) + Vec2{0, 30});
  };
  const Pixel collision{255, 59, 78}, red_light{226, 59, 208}, off_road{255, 154, 31}, wall{201, 138, 75};
  EXPECT_LT(distance(ring(0), collision), 20);
  EXPECT_LT(distance(ring(1), red_light), 20);
  EXPECT_EQ(ring(2), kGround);
  EXPECT_LT(distance(ring(3), off_road), 20);
  EXPECT_EQ(count(image, wall), 100) << "in the legend alone, a square of 10 px";
  // Other counts change the legend, whose digits are in the bottom left corner.
  reasons[1] = kEventCollision;
  const RgbImage more = painter.draw(frame, camera);
  int different = 0;
  for (int y = 600 - 120; y < 590; ++y) {
    for (int x = 10; x < 142; ++x) different += at(image, x, y) != at(more, x, y);
  }
  EXPECT_GT(different, 20);
  frame.status = {};
  EXPECT_THAT(test::message_of([&] { painter.draw(frame, camera); }), HasSubstr("4 agents, got 0 and 4"));
}

TEST(WorldPainter, DrawsWalls) {
  WorldPainter painter(town(), 400, 300, {{{490, 400, 0}, {510, 400, 0}, 5}});
  const TopCamera camera = painter.around({500, 400}, 40);
  const RgbImage image = painter.draw({}, camera);
  EXPECT_EQ(at(image, 200, 150), (Pixel{122, 101, 82}));
  EXPECT_EQ(at(image, 200, 160), kGround);
  EXPECT_EQ(at(image, 320, 150), kGround) << "beyond its end";
}

TEST(WorldPainter, LinesConnectAgentsAndGoals) {
  WorldPainter painter(town(), 400, 300);
  const std::vector<AgentBox> agents{box(500, 400, 0)};
  const std::vector<AgentGoal> goals{{0, {500, 410}}};
  WorldFrame frame;
  frame.agents = agents;
  frame.goals = goals;
  const TopCamera camera = painter.around({500, 400}, 40);
  const RgbImage image = painter.draw(frame, camera);
  const Vec2 goal = painter.pixel_of(camera, {500, 410});
  EXPECT_EQ(at(painter.draw({.agents = agents}, camera), goal), kGround);
  EXPECT_NE(at(image, goal), kGround);
  EXPECT_NE(at(image, goal + Vec2{0, 30}), kGround) << "on the way";
  EXPECT_EQ(at(image, goal - Vec2{0, 10}), kGround) << "beyond";
}

TEST(WorldPainter, MovingTheCameraOnlyShiftsThePicture) {
  // At 8 px a metre 16 m are 128 px, so the cached tiles are cropped differently.
  WorldPainter painter(town(), 640, 480), fresh(town(), 640, 480);
  const Vec2 middle = town().points_of(town().lanes[0])[0].position_m.xy();
  const RgbImage a = painter.draw({}, painter.around(middle, 80));
  const RgbImage b = painter.draw({}, painter.around(middle + Vec2{16, 0}, 80));
  int different = 0;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640 - 128; ++x) different += at(a, x + 128, y) != at(b, x, y);
  }
  EXPECT_EQ(different, 0);
  EXPECT_GT(static_cast<int>(a.rgb.size()) / 3 - count(a, kGround), 5000);  // not an empty picture
  EXPECT_EQ(fresh.draw({}, fresh.around(middle + Vec2{16, 0}, 80)).rgb, b.rgb);
  // Draw at another scale, then at the first one again.
  painter.draw({}, painter.whole_map());
  EXPECT_EQ(painter.draw({}, painter.around(middle, 80)).rgb, a.rgb);
}

TEST(WorldPainter, TheWholeMapIsInThePicture) {
  WorldPainter painter(town(), 500, 300);
  const TopCamera camera = painter.whole_map();
  for (const LanePoint& point : town().lane_points) {
    const Vec2 p = painter.pixel_of(camera, point.position_m.xy());
    ASSERT_TRUE(p.x > 0 && p.y > 0 && p.x < 500 && p.y < 300);
  }
  const LanePoint& point = town().points_of(town().lanes[0])[0];
  EXPECT_NE(at(painter.draw({}, camera), painter.pixel_of(camera, point.position_m.xy())), kGround);
}

TEST(WorldPainter, LightsShowTheirState) {
  RoadMap map = town();
  TrafficLight light;
  light.stop_a_m = {500, 401, 0};
  light.stop_b_m = {500, 398, 0};
  light.head_m = {505, 400, 5};
  light.head_facing = {-1, 0};
  map.lights = {light};
  WorldPainter painter(map, 400, 300);
  const auto head = [&](LightState state) {
    WorldFrame frame;
    frame.lights = {&state, 1};
    return at(painter.draw(frame, painter.around({500, 400}, 40)), 250, 150);
  };
  EXPECT_EQ(head(LightState::red), (Pixel{255, 0, 0}));
  EXPECT_EQ(head(LightState::yellow), (Pixel{255, 200, 0}));
  EXPECT_EQ(head(LightState::green), (Pixel{0, 255, 0}));
  EXPECT_EQ(head(LightState::off), head(LightState::unknown));
  EXPECT_LT(head(LightState::off).g, 100);
  const LightHead moved{.position_m = {508, 400, 5}, .facing = {-1, 0}};
  WorldFrame frame_of_moved;
  const LightState red = LightState::red;
  frame_of_moved.lights = {&red, 1};
  frame_of_moved.heads = {&moved, 1};
  const RgbImage image = painter.draw(frame_of_moved, painter.around({500, 400}, 40));
  EXPECT_EQ(at(image, 280, 150), (Pixel{255, 0, 0}));
  EXPECT_NE(at(image, 250, 150), (Pixel{255, 0, 0}));
  const std::vector<LightState> two(2);
  WorldFrame frame;
  frame.lights = two;
  EXPECT_THAT(test::message_of([&] { painter.draw(frame, painter.whole_map()); }), HasSubstr("1 lights, got 2"));
}

TEST(WorldPainter, RecordedPathsAreDrawnBelowBoxes) {
  const std::shared_ptr<const Scenario> scene = test::crossing();
  WorldPainter bare(scene->map, 500, 500), painter(scene->map, 500, 500, {}, scene.get());
  const TopCamera camera = painter.whole_map();
  const auto self_at = [&](int step) {
    const TrackState& state = scene->states_of(scene->sdc_track)[step];
    return painter.pixel_of(camera, state.position_m.xy());
  };
  WorldFrame frame;
  const RgbImage ground = bare.draw(frame, camera), ways = painter.draw(frame, camera);
  frame.recorded_step = scene->current_step;
  const RgbImage boxes = painter.draw(frame, camera);
  for (const int step : {scene->current_step, 40, 80}) {
    const Vec2 p = self_at(step);
    EXPECT_GT(distance(at(ways, p), at(ground, p)), 30) << step;
    if (step > scene->current_step) {
      EXPECT_EQ(at(boxes, p), at(ways, p)) << step;
    }
  }
  EXPECT_NE(boxes.rgb, ways.rgb);
  frame.recorded_step = scene->num_steps;
  EXPECT_THROW(painter.draw(frame, camera), Error);
  frame.recorded_step = 0;
  EXPECT_THROW(bare.draw(frame, camera), Error);
}

TEST(WorldPainter, RejectsSizesOutOfRange) {
  EXPECT_THROW(WorldPainter(town(), 10, 300), Error);
  EXPECT_THROW(WorldPainter(town(), 400, 10000), Error);
  EXPECT_THROW(WorldPainter(RoadMap{}, 400, 300), Error);
}

/// Two worlds of two slots and, in the second, one parked car.
class StillSimulator final : public Simulator {
 public:
  StillSimulator() : Simulator("still") {
    parts_ = &parts_of_it_;
    agents_ = {box(500, 400, 0), box(500, 410, 0), box(500, 400, kPi), box(520, 400, 0), box(500, 390, 0)};
    world_begin_ = {0, 2, 5};
    light_begin_ = {0, static_cast<int32_t>(town().lights.size()), static_cast<int32_t>(2 * town().lights.size())};
    lights_.resize(2 * town().lights.size());
    arrays_.slots.world_of_slot = world_of_slot_;
    arrays_.scene.world_begin = world_begin_;
    arrays_.scene.agents = agents_;
    arrays_.scene.light_begin = light_begin_;
    arrays_.scene.light_states = lights_;
    arrays_.state.status = status_.data();
    arrays_.state.halt_reason = halt_reason_.data();
    arrays_.state.next_waypoint = next_waypoint_.data();
    arrays_.state.waypoint_x_m = waypoint_x_m_.data();
    arrays_.state.waypoint_y_m = waypoint_y_m_.data();
  }
  void set_device(Device device) { arrays_.device = device; }
  void set_status(int slot, AgentStatus status) { status_[slot] = status; }
  void set_worlds(CompiledMaps, std::vector<GeometryHandle>, std::vector<WorldSpec>, uint64_t, Stream) override {}
  void reserve(const SimulatorCapacity&) override {}
  SpawnReport spawn_report(Stream) const override { return {}; }
  const SimulatorTotals& totals(Stream) const override { return totals_; }
  uint64_t state_hash(Stream) const override { return 0; }
  std::vector<uint8_t> save(Stream) const override { return {}; }
  void restore(Span<const uint8_t>, Stream) override {}
  std::unique_ptr<StateSnapshot> snapshot(Stream) const override { return nullptr; }
  void restore(const StateSnapshot&, Stream) override {}

 private:
  StepResult step_actions(Span<const int32_t>, Stream) override { return {}; }
  StepResult step_commands(Span<const Command>, Stream) override { return {}; }
  void reset_worlds(Span<const uint8_t>, uint64_t, Stream) override {}
  void apply_edit(const StateEdit&, Stream) override {}
  void answer_queries(const ObservationQueries&, Stream) override {}

  const SimulatorParts parts_of_it_{.config = {},
                                    .maps = {std::make_shared<const CompiledMap>()},  // heads stand as mapped
                                    .handles = {},
                                    .worlds = {{0, 2, 0}, {0, 2, 1}}};
  SimulatorTotals totals_;
  std::vector<int32_t> world_of_slot_{0, 0, 1, 1};
  std::vector<AgentBox> agents_;
  std::vector<int32_t> world_begin_, light_begin_;
  std::vector<LightState> lights_;
  // Only slot 2 has waypoints, and it has passed the first.
  std::vector<AgentStatus> status_{AgentStatus::active, AgentStatus::active, AgentStatus::active, AgentStatus::halted};
  std::vector<uint8_t> halt_reason_{0, 0, 0, kEventWall};
  std::vector<int32_t> next_waypoint_{0, 0, 1, 0};
  std::vector<float> waypoint_x_m_ = std::vector<float>(12, 505.0f);
  std::vector<float> waypoint_y_m_{0, 0, 0, 0, 0, 0, 395, 400, 405, 0, 0, 0};
};

TEST(DrawWorld, ShowsTheAgentsOfOneWorldAndFollowsOne) {
  StillSimulator simulator;
  WorldPainter painter(town(), 400, 300);
  const RgbImage image = draw_world(painter, simulator, 1, 0, 40);
  EXPECT_EQ(at(image, 200 + 15, 150), kVehicleBody);  // slot 0 of world 1 drives west
  EXPECT_EQ(at(image, 200 - 12, 150), kVehicleMark);
  EXPECT_EQ(at(image, 185, 50), kGround);        // an agent of world 0
  EXPECT_NE(at(image, 385, 150), kVehicleBody);  // halted
  EXPECT_NE(at(image, 385, 150), kGround);
  const Pixel parked = at(image, 185, 250);
  EXPECT_NE(parked, kVehicleBody);
  EXPECT_NE(parked, kGround);
  const Pixel halo{255, 228, 92};
  EXPECT_EQ(at(image, 250, 150), halo);  // the next waypoint
  EXPECT_EQ(at(image, 250, 100), halo);  // the waypoint after the next one
  EXPECT_EQ(at(image, 250, 200), kGround) << "a passed waypoint is not drawn";
  EXPECT_EQ(count(draw_world(painter, simulator, 0), halo), 0);
  EXPECT_THAT(test::message_of([&] { draw_world(painter, simulator, 2); }), HasSubstr("[0, 2), got 2"));
  EXPECT_THAT(test::message_of([&] { draw_world(painter, simulator, 1, 2); }), HasSubstr("below 2, got 2"));
  simulator.set_status(2, AgentStatus::waiting);
  EXPECT_EQ(draw_world(painter, simulator, 1, 0, 40).rgb, draw_world(painter, simulator, 1).rgb)
      << "no absent agent is followed";
  simulator.set_device({MemorySpace::cuda, 0});
  EXPECT_THAT(test::message_of([&] { draw_world(painter, simulator, 1); }), HasSubstr("host memory"));
}

TEST(DrawMap, FillsItsSizeAndShowsLanesAndEdges) {
  for (const int size : {300, 1000}) {
    const RgbImage image = draw_map(town(), {.size_px = size});
    EXPECT_EQ(std::max(image.width_px, image.height_px), size);
    EXPECT_GT(count(image, {91, 97, 107}), size * size / 50);     // driving lanes
    EXPECT_GT(count(image, {211, 206, 194}), size * size / 100);  // sidewalks
    EXPECT_GT(count(image, kGround), size * size / 5);            // blocks of houses
  }
  const RoadMap wide = parse_opendrive(procedural_town({3, 6, 1}), "wide");
  const RgbImage image = draw_map(wide, {.size_px = 800});
  EXPECT_EQ(image.width_px, 800);
  EXPECT_LT(image.height_px, 400);
}

/// One lane of 100 m along y = 0 from x = 0; the map's origin is (1000, 500) in the file.
RoadMap one_road() {
  const test::RoadText road{.geometry = test::line_at(0, 1000, 500, 0, 100), .right = test::lane_of(-1, "driving", 4)};
  return parse_opendrive(test::file_of(road.text()), "one_road");
}

/// A picture of the 80 m x 30 m around the middle of one_road(), and the pixels of the road's points.
struct Closeup {
  explicit Closeup(const RoadMap& road_map)
      : map(road_map), image(draw_map(map, {.size_px = 800, .box = FileBox{1010, 485, 1090, 515}})) {}
  /// Reads a pixel by the layout of draw_map(): margins of 28 px and a strip of 36 px below, at half of its 1600 px.
  Pixel at_m(float x_m, float y_m) const {
    constexpr float kPxPerM = (800 - 28) / 80.0f;
    return at(image,
              Vec2{400 + (x_m - 50) * kPxPerM, static_cast<float>(image.height_px) - 14 - 18 - (y_m + 15) * kPxPerM});
  }
  const RoadMap& map;
  RgbImage image;
};

TEST(DrawMap, ShowsAPartInFileCoordinates) {
  const RoadMap map = one_road();
  ASSERT_EQ(map.origin_m[0], 1000);
  ASSERT_EQ(map.origin_m[1], 500);
  const Closeup closeup(map);
  EXPECT_EQ(closeup.image.width_px, 800);
  const Pixel driving{91, 97, 107}, edge{200, 49, 47};
  EXPECT_EQ(closeup.at_m(30, -1.0f), driving);
  EXPECT_EQ(closeup.at_m(30, -3.4f), driving);
  // Lines of one or two pixels, between other colours.
  EXPECT_LT(distance(closeup.at_m(30, -4), edge), 80);
  EXPECT_LT(distance(closeup.at_m(30, 0), edge), 80);
  EXPECT_EQ(closeup.at_m(30, -4.6f), kGround);
  EXPECT_EQ(closeup.at_m(30, 1.0f), kGround);
  int white = 0;
  for (float x = 10; x < 90; x += 0.1f) white += closeup.at_m(x, -2).r > 140;
  EXPECT_GT(white, 10) << "arrows along the lane";
}

TEST(DrawMap, HeadsShowTheirDirectionAndAngle) {
  RoadMap map = one_road();
  TrafficLight light;
  light.stop_a_m = {60, 0, 0};
  light.stop_b_m = {60, -4, 0};
  light.head_m = {60, 8, 5};
  light.head_facing = {-1, 0};
  light.phase = 1;
  map.lights = {light};
  map.junctions = {{"7", 2}};
  const Closeup closeup(map);
  const Pixel phase{255, 122, 26};
  EXPECT_EQ(closeup.at_m(60, 8), phase) << "the head";
  EXPECT_EQ(closeup.at_m(60, -2), phase) << "its stop line";
  const auto around = [&](float angle_deg) {  // from the direction that the light faces
    const float angle_rad = kPi + angle_deg * kPi / 180;
    return closeup.at_m(60 + 4 * std::cos(angle_rad), 8 + 4 * std::sin(angle_rad));
  };
  for (const float inside : {-55.0f, 0.0f, 55.0f}) EXPECT_NE(around(inside), kGround) << inside;
  for (const float outside : {-65.0f, 65.0f, 120.0f}) EXPECT_EQ(around(outside), kGround) << outside;
}

TEST(DrawMap, ShowsSignsPaintAndBuildingLines) {
  RoadMap map = one_road();
  const Closeup plain(map);
  const Pixel sign{214, 36, 127}, building{138, 90, 60}, violet{176, 124, 255};
  for (const Pixel ink : {sign, violet}) EXPECT_EQ(count(plain.image, ink), 0);
  EXPECT_EQ(plain.at_m(40, 9), kGround);
  map.signs = {{"1", "206", "", "OpenDRIVE", {30, -9, 2}, 0, {}}};
  map.building_lines = {{{70, 9, 0}, {30, 9, 0}}};  // buildings to the south
  map.stop_lines = {{{40, 0, 0}, {40, -4, 0}, 0.5f}};
  map.marking_points = {{50, -1, 0}, {80, -1, 0}};
  map.markings = {{{0, 2}, 0.4f, MarkColor::violet, false}};
  const Closeup full(map);
  EXPECT_EQ(full.at_m(30, -9), sign);
  EXPECT_LT(full.at_m(28.6f, -9).g, 200) << "a tail towards the traffic, which drives east";
  EXPECT_EQ(full.at_m(28.6f, -8.5f), kGround);
  EXPECT_LT(distance(full.at_m(40, 9), building), 40);
  EXPECT_NE(full.at_m(40, 8.4f), kGround);
  EXPECT_EQ(full.at_m(40, 9.6f), kGround);
  EXPECT_EQ(full.at_m(40, -3), (Pixel{255, 255, 255})) << "the stop line";
  EXPECT_NEAR(full.at_m(60, -1).b, violet.b, 15);
}

TEST(DrawMap, ParkingSpacesBesideTheRoadAreInThePicture) {
  test::RoadText road;
  road.right = test::lane_of(-1, "driving", 3);
  const auto height_px = [&] { return draw_map(test::parse(road.text()), {.size_px = 800}).height_px; };
  const int of_the_road_px = height_px();
  road.rest =
      R"(<objects><object id="1" type="parkingSpace" s="50" t="-20" zOffset="0" hdg="0" length="5" width="2.5"/></objects>)";
  const double px_per_m = 8;  // at least: 100 m on 800 px, less margins
  EXPECT_GT(height_px(), of_the_road_px + 0.8 * 17 * px_per_m);
}

TEST(DrawMap, TheSvgHasTheSameSizeAndIsComplete) {
  const ScratchFolder folder;
  draw_map_svg(town(), folder / "map.svg", {.size_px = 700});
  const RgbImage image = draw_map(town(), {.size_px = 700});
  const std::string svg = read_file(folder / "map.svg");
  EXPECT_THAT(svg, HasSubstr(fmt::format("viewBox=\"0 0 {} {}\"", image.width_px, image.height_px)));
  EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
  size_t paths = 0;
  for (size_t i = svg.find("<path"); i != std::string::npos; i = svg.find("<path", i + 1)) ++paths;
  EXPECT_GT(paths, 2 * town().lanes.size());
  EXPECT_EQ(folder.num_entries(), 1u);
  EXPECT_THAT(test::message_of([] { draw_map_svg(town(), "/nonexistent/a/map.svg"); }), HasSubstr("/nonexistent/a/"));
}

TEST(DrawMap, RejectsEmptyParts) {
  const RoadMap map = one_road();
  const auto message = [&](FileBox box) { return test::message_of([&] { draw_map(map, {.box = box}); }); };
  EXPECT_THAT(message({1090, 485, 1010, 515}), HasSubstr("expected a box of 1 to 1000000 m"));
  EXPECT_THAT(message({1010, 500, 1010, 515}), HasSubstr("expected a box"));
  EXPECT_THAT(message({1010, 500, std::nan(""), 515}), HasSubstr("expected a box"));
  EXPECT_THAT(message({0, 0, 1e9, 15}), HasSubstr("expected a box"));
  EXPECT_THAT(message({0, 500, 900, 515}), HasSubstr("which lies in (998, 496) to (1102, 500)"));
}

TEST(DrawMap, RejectsInvalidSizesMapsAndPaths) {
  EXPECT_THROW(draw_map(town(), {.size_px = 63}), Error);
  EXPECT_THROW(draw_map(town(), {.size_px = 20000}), Error);
  EXPECT_THAT(test::message_of([] { draw_map(RoadMap{}, {.size_px = 300}); }), HasSubstr("nothing to draw"));
  EXPECT_THAT(test::message_of([] { draw_map_png(town(), "/nonexistent/a/map.png", {.size_px = 300}); }),
              HasSubstr("/nonexistent/a/map.png"));
  const ScratchFolder folder;
  draw_map_png(town(), folder / "map.png", {.size_px = 300});
  EXPECT_EQ(read_png(folder / "map.png").rgb, draw_map(town(), {.size_px = 300}).rgb);
  EXPECT_EQ(folder.num_entries(), 1u);
}

TEST(ContactSheet, EnlargesEveryPixelWithoutSmoothing) {
  Rig rig = paper_rig(8, 6);
  HostImages images(rig, 3);
  // View 2, camera 1: its pixel (5, 3) is red.
  const CameraImages& camera = images.camera(1);
  auto* data = static_cast<uint8_t*>(camera.data) + 2 * camera.view_stride;
  data[3 * 8 + 5] = 255;
  const RgbImage sheet = contact_sheets(images, rig, {"0", "1", "2"}, 4).front();
  EXPECT_EQ(count(sheet, {255, 0, 0}), 16);
  int x0 = -1, y0 = -1;
  for (int y = 0; y < sheet.height_px && y0 < 0; ++y) {
    for (int x = 0; x < sheet.width_px && y0 < 0; ++x) {
      if (at(sheet, x, y) == Pixel{255, 0, 0}) x0 = x, y0 = y;
    }
  }
  EXPECT_EQ(at(sheet, x0 + 3, y0 + 3), (Pixel{255, 0, 0}));
  // The rest of that image is black around the pixel: 5 pixels to the left, 2 to the right, 3 above, 2 below.
  EXPECT_EQ(at(sheet, x0 - 1, y0), (Pixel{0, 0, 0}));
  EXPECT_EQ(at(sheet, x0 - 5 * 4, y0 - 3 * 4), (Pixel{0, 0, 0}));
  EXPECT_NE(at(sheet, x0 - 5 * 4 - 1, y0), (Pixel{0, 0, 0}));
  EXPECT_EQ(at(sheet, x0 + 3 * 4 - 1, y0 + 3 * 4 - 1), (Pixel{0, 0, 0}));
  EXPECT_NE(at(sheet, x0 + 3 * 4, y0), (Pixel{0, 0, 0}));
  EXPECT_GT(contact_sheets(images, rig, {"0"}).front().width_px, 1500);
  EXPECT_THROW(contact_sheets(images, rig, {}), Error);
}

TEST(ContactSheet, ContinuesOnMoreRowsAndPages) {
  const Rig rig = paper_rig(96, 54);
  std::vector<std::string> names;
  for (int view = 0; view < 80; ++view) names.push_back(std::to_string(view));
  HostImages images(rig, 80);
  // Set the first pixel of the first and the last view.
  for (const int view : {0, 79}) {
    static_cast<uint8_t*>(images.camera(0).data)[view * images.camera(0).view_stride] = 255;
  }
  const std::vector<RgbImage> pages = contact_sheets(images, rig, names);
  ASSERT_EQ(pages.size(), 3u);
  EXPECT_EQ(count(pages[0], {255, 0, 0}), 4 * 4);
  EXPECT_EQ(count(pages[1], {255, 0, 0}), 0);
  EXPECT_EQ(count(pages[2], {255, 0, 0}), 4 * 4);
  for (const RgbImage& page : pages) EXPECT_LE(page.height_px, 8192);
  const ScratchFolder folder;
  FilledFolder filled(folder.path(), "render");
  EXPECT_EQ(draw_contact_sheets(images, rig, names, &filled),
            (std::vector<std::string>{folder / "contact_sheet.png", folder / "contact_sheet_2.png",
                                      folder / "contact_sheet_3.png"}));
  EXPECT_EQ(read_png(folder / "contact_sheet_3.png").rgb, pages[2].rgb);
  // Five cameras of 8,000 px: two a row.
  Rig wide{.cameras = std::vector<Camera>(5, paper_rig(8000, 2).cameras[0])};
  const std::vector<RgbImage> sheet = contact_sheets(HostImages(wide, 1), wide, {"0"});
  ASSERT_EQ(sheet.size(), 1u);
  EXPECT_LT(sheet[0].width_px, 16500);
  EXPECT_GT(sheet[0].height_px, 3 * 2);
}

TEST(Interrupts, EndRunningDrawingsButNotLaterOnes) {
  EXPECT_EXIT(
      {
        catch_interrupts();
        // Encoding takes seconds, so the signal arrives during the work.
        const std::vector<uint8_t> rgb(size_t{3} * 12000 * 12000);
        std::thread soon([] {
          std::this_thread::sleep_for(std::chrono::milliseconds(300));
          ::kill(::getpid(), SIGTERM);
        });
        std::string message = test::message_of<Interrupted>([&] { write_png("/dev/null", 12000, 12000, rgb); });
        soon.join();
        write_png("/dev/null", 1, 1, Span<const uint8_t>(rgb.data(), 3));
        draw_map(town(), {.size_px = 100});
        std::fputs(message.c_str(), stderr);
        std::exit(0);
      },
      testing::ExitedWithCode(0), "/dev/null: interrupted while it was written");
}

TEST(Figure, PanelsAreInRowsOfThreeAboveTheirCaptions) {
  HostImages images(paper_rig(8, 6), 1);
  static_cast<uint8_t*>(images.camera(0).data)[0] = 255;  // the corner is red
  const RgbImage panel = captioned(images, 0, 0, "(a) a corner");
  EXPECT_EQ(panel.width_px, 480);
  EXPECT_EQ(count(panel, {255, 0, 0}), 60 * 60);
  EXPECT_GT(panel.height_px, 360);
  const RgbImage figure = assembled({panel, panel, panel, panel});
  EXPECT_EQ(count(figure, {255, 0, 0}), 4 * 60 * 60);
  EXPECT_EQ(at(figure, 0, panel.height_px + 6), (Pixel{255, 0, 0}));
  EXPECT_EQ(at(figure, 2 * (panel.width_px + 6), 0), (Pixel{255, 0, 0}));
  EXPECT_EQ(at(figure, panel.width_px + 3, 0), (Pixel{255, 255, 255}));
  EXPECT_THROW(assembled({}), Error);
  EXPECT_THROW(assembled({panel, figure}), Error);
}

TEST(Planes, HaveTheirColors) {
  Rig rig = paper_rig(4, 1);
  HostImages images(rig, 2, PixelFormat::u8, Planes::all);
  const CameraImages& camera = images.camera(1);
  const float depths_m[] = {std::numeric_limits<float>::infinity(), 0.5f, 60, 119.99f};
  for (size_t i = 0; i < 4; ++i) {
    camera.depth_m[4 + i] = depths_m[i];
    camera.class_id[4 + i] = static_cast<uint8_t>(3 * i);
    camera.instance_id[4 + i] = static_cast<uint16_t>(i / 2);
  }
  const RgbImage depth = plane_picture(images, 1, 1, Plane::depth);
  EXPECT_EQ(at(depth, 0, 0), (Pixel{0, 0, 0}));
  EXPECT_EQ(at(depth, 1, 0), (Pixel{254, 254, 254}));
  EXPECT_EQ(at(depth, 2, 0), (Pixel{128, 128, 128}));
  EXPECT_EQ(at(depth, 3, 0), (Pixel{1, 1, 1}));
  const RgbImage classes = plane_picture(images, 1, 1, Plane::class_id);
  EXPECT_EQ(at(classes, 0, 0), (Pixel{0, 0, 0}));
  EXPECT_EQ(at(classes, 1, 0), (Pixel{128, 237, 153}));
  EXPECT_EQ(at(classes, 2, 0), (Pixel{225, 230, 240}));
  EXPECT_EQ(at(classes, 3, 0), (Pixel{98, 183, 249}));
  const RgbImage instances = plane_picture(images, 1, 1, Plane::instance_id);
  EXPECT_EQ(at(instances, 1, 0), (Pixel{0, 0, 0}));
  EXPECT_EQ(at(instances, 2, 0), at(instances, 3, 0));
  EXPECT_NE(at(instances, 2, 0), (Pixel{0, 0, 0}));
  EXPECT_THROW(plane_by_name("colour"), UsageError);
  EXPECT_THROW(plane_picture(HostImages(rig, 1), 0, 0, Plane::depth), Error);
}

TEST(Ticks, AreRound) {
  EXPECT_THAT(round_ticks(0, 10, 5), testing::ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(round_ticks(-1, 1, 4), testing::ElementsAre(-1, -0.5, 0, 0.5, 1));
  EXPECT_THAT(round_ticks(1.3e6, 2.9e6, 3), testing::ElementsAre(1.5e6, 2e6, 2.5e6));
  EXPECT_TRUE(round_ticks(1, 1, 4).empty());
  EXPECT_LT(round_ticks(1 - 1e-16, 1, 5).size(), 21u) << "a range that a double hardly tells from its ends";
  EXPECT_LT(round_ticks(1e17, std::nextafter(1e17, 2e17), 5).size(), 21u);
  EXPECT_TRUE(round_ticks(0, std::numeric_limits<double>::infinity(), 4).empty());
}

// ---- video

RgbImage solid(int width, int height, Pixel color) {
  RgbImage image{width, height, std::vector<uint8_t>(static_cast<size_t>(3 * width * height))};
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    image.rgb[i] = static_cast<uint8_t>(color.r);
    image.rgb[i + 1] = static_cast<uint8_t>(color.g);
    image.rgb[i + 2] = static_cast<uint8_t>(color.b);
  }
  return image;
}

std::string output_of(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string output;
  char buffer[4096];
  for (size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.append(buffer, n);
  pclose(pipe);
  return output;
}

bool has_ffmpeg() { return std::system("ffmpeg -version > /dev/null 2>&1 && ffprobe -version > /dev/null 2>&1") == 0; }

bool has_children() { return !(waitpid(-1, nullptr, WNOHANG) < 0 && errno == ECHILD); }

TEST(Video, ContainsTheGivenFrames) {
  if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg and ffprobe on this machine";
  const ScratchFolder folder;
  for (const std::string ending : {"mp4", "gif"}) {
    const std::string path = folder / ("film." + ending);
    VideoWriter video(path, 64, 48, 10);
    const Pixel colors[] = {{200, 30, 30}, {30, 180, 40}, {40, 40, 220}};
    for (int i = 0; i < 10; ++i) video.add(solid(64, 48, colors[i % 3]));
    EXPECT_FALSE(fs::exists(path));
    video.finish();
    EXPECT_FALSE(has_children());
    EXPECT_EQ(output_of("ffprobe -v error -count_frames -select_streams v -show_entries "
                        "stream=width,height,nb_read_frames,r_frame_rate -of csv=p=0 " +
                        path),
              "64,48,10/1,10\n");
    const std::string raw = output_of("ffmpeg -v error -i " + path + " -f rawvideo -pix_fmt rgb24 -");
    ASSERT_EQ(raw.size(), size_t{10 * 64 * 48 * 3});
    for (size_t i = 0; i < 10; ++i) {
      const auto* middle = reinterpret_cast<const uint8_t*>(raw.data()) + ((i * 48 + 24) * 64 + 32) * 3;
      EXPECT_NEAR(middle[0], colors[i % 3].r, 14) << ending << " frame " << i;
      EXPECT_NEAR(middle[1], colors[i % 3].g, 14) << ending << " frame " << i;
      EXPECT_NEAR(middle[2], colors[i % 3].b, 14) << ending << " frame " << i;
    }
    EXPECT_THAT(test::message_of([&] { video.add(solid(64, 48, {0, 0, 0})); }), HasSubstr("has ended"));
  }
  EXPECT_EQ(folder.num_entries(), 2u);
}

TEST(Video, OddSidesLoseTheirLastPixel) {
  if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg and ffprobe on this machine";
  const ScratchFolder folder;
  VideoWriter video(folder / "odd.mp4", 65, 47, 30);
  video.add(solid(65, 47, {90, 90, 90}));
  video.finish();
  EXPECT_EQ(output_of("ffprobe -v error -show_entries stream=width,height,pix_fmt -of csv=p=0 " + (folder / "odd.mp4")),
            "64,46,yuv420p\n");
}

TEST(Video, RejectsBadPathsAndFrames) {
  if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg and ffprobe on this machine";
  EXPECT_THAT(test::message_of([] { VideoWriter("/nonexistent/a/film.mp4", 64, 48, 10); }),
              HasSubstr("/nonexistent/a/film.mp4"));
  EXPECT_THROW(VideoWriter("film.avi", 64, 48, 10), UsageError);
  EXPECT_THROW(VideoWriter("film.mp4", 0, 48, 10), Error);
  EXPECT_THROW(VideoWriter("film.mp4", 64, 48, 0), Error);
  EXPECT_THROW(VideoWriter("film.mp4", 64, 48, std::nan("")), Error);
  const ScratchFolder folder;
  {
    VideoWriter video(folder / "film.mp4", 64, 48, 10);
    EXPECT_THAT(test::message_of([&] { video.add(solid(48, 64, {0, 0, 0})); }), HasSubstr("64x48 px, got 48x64"));
    EXPECT_THAT(test::message_of([&] { video.finish(); }), HasSubstr("expected at least one frame"));
    video.add(solid(64, 48, {0, 0, 0}));
  }
  EXPECT_EQ(folder.num_entries(), 0u) << "an unfinished film leaves nothing";
  const pid_t child = ::fork();
  if (child == 0) {
    VideoWriter video(folder / "film.mp4", 64, 48, 10);
    video.add({64, 48, std::vector<uint8_t>(64 * 48 * 3)});
    ::raise(SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(folder.num_entries(), 0u) << "nor does a killed process";
  EXPECT_FALSE(has_children());
}

TEST(Video, ReportsAMissingFfmpeg) {
  const ScratchFolder folder, empty;
  const EnvironmentVariable path("PATH", empty.path());
  const std::string message = test::message_of([&] { VideoWriter(folder / "film.mp4", 64, 48, 10); });
  EXPECT_THAT(message, HasSubstr("ffmpeg program"));
  EXPECT_EQ(folder.num_entries(), 0u);
}

// Writes a program named ffmpeg with these lines into a folder.
void write_ffmpeg(const ScratchFolder& programs, const std::string& lines) {
  std::ofstream(programs / "ffmpeg") << "#!/bin/sh\n" << lines;
  fs::permissions(programs / "ffmpeg", fs::perms::owner_all);
}

TEST(Video, ReportsAnFfmpegWithoutOutput) {
  const ScratchFolder folder, programs;
  write_ffmpeg(programs, "while read -r line; do :; done\n");
  const EnvironmentVariable path("PATH", programs.path());
  const std::string file = folder / "film.mp4";
  EXPECT_EQ(test::message_of([&] {
              VideoWriter video(file, 64, 48, 10);
              video.add(solid(64, 48, {0, 0, 0}));
              video.finish();
            }),
            file + ": ffmpeg wrote nothing");
  EXPECT_EQ(folder.num_entries(), 0u);
}

TEST(Video, ReportsFfmpegsLastLine) {
  const ScratchFolder folder, programs;
  write_ffmpeg(programs, "echo first line >&2\necho 'Unknown encoder' >&2\nexit 3\n");
  const EnvironmentVariable path("PATH", programs.path());
  const std::string file = folder / "film.mp4";
  const std::string message = test::message_of([&] {
    VideoWriter video(file, 640, 480, 10);
    // More frames than any socket buffers, so that the writer must handle the closed end.
    for (int i = 0; i < 30; ++i) video.add(solid(640, 480, {0, 0, 0}));
    video.finish();
  });
  EXPECT_EQ(message, file + ": ffmpeg ended with status 3: Unknown encoder");
  EXPECT_EQ(folder.num_entries(), 0u);
  EXPECT_FALSE(has_children());
}

TEST(Film, ShowsTheCamerasOfAPolicyEnlargedWithTheirLines) {
  RendererConfig trained{.rig = paper_rig(50, 30), .line_floor_px = 0.5f};
  const RendererConfig view = film_view(trained);
  ASSERT_EQ(view.rig.cameras.size(), trained.rig.cameras.size());
  for (std::size_t c = 0; c < view.rig.cameras.size(); ++c) {
    const Camera &shown = view.rig.cameras[c], &seen = trained.rig.cameras[c];
    EXPECT_EQ(shown.width_px, 250);
    EXPECT_EQ(shown.height_px, 150);
    EXPECT_FLOAT_EQ(shown.focal_x_px, 5 * seen.focal_x_px);
    EXPECT_FLOAT_EQ(shown.center_y_px, 5 * seen.center_y_px);
    EXPECT_EQ(shown.yaw_rad, seen.yaw_rad);
  }
  EXPECT_FLOAT_EQ(view.line_floor_px, 2.5f);
  EXPECT_EQ(film_order(paper_rig()), (std::vector<int>{1, 0, 2, 3}));
}

}  // namespace
}  // namespace pictura
