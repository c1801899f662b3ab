// The CPU renderer's images compared with values computed by hand: rules, sizes, planes, visibility, and errors.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/compositing.h"
#include "pictura/common/raster/shapes.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/image_drawing.h"
#include "pictura/tests/support/renderer_interface.h"

namespace pictura {
namespace {

using testing::HasSubstr;

TEST(CpuRenderer, DrawsABoxAtHandComputedPixels) {
  // The back of a car 10 m ahead: 2 m wide, 1 m high, at 50 px/m/m. Columns 50 - 5 to 50 + 5. The roof, 1 m up, is at
  // row 50 + 50 * 0.5/10 = 52.5; the ground is at row 50 + 50 * 1.5/10 = 57.5.
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {12, 0, 0}, 0, {4, 2, 1})});
  const Drawn image = draw(no_geometry(), scene, {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
  const Rgb back = rgb8(76, 201, 240) * (1 - 10.0f / 120), top = rgb8(58, 12, 163) * (1 - 12.0f / 120);
  expect_color(image.at(50, 55), back);
  expect_color(image.at(45, 53), back);
  expect_color(image.at(54, 56), back);
  expect_color(image.at(44, 55), {});
  expect_color(image.at(55, 55), {});
  expect_color(image.at(50, 57), back * 0.5f);
  // Row 52: the roof reaches from 50 + 25/14 = 51.79 to 52.5; the back covers the lower half.
  expect_color(image.at(50, 52), {0.5f * (top.r + back.r), 0.5f * (top.g + back.g), 0.5f * (top.b + back.b)});
  const float roof_part = 52 - (50 + 25.0f / 14);
  expect_color(image.at(50, 51), top * roof_part);
}

TEST(CpuRenderer, EachClassAndFaceHasItsColor) {
  for (const AgentClass agent_class : {AgentClass::vehicle, AgentClass::cyclist, AgentClass::pedestrian}) {
    const std::pair<float, BoxFace> turns[] = {
        {0.0f, BoxFace::back}, {kPi, BoxFace::front}, {kHalfPi, BoxFace::left}, {-kHalfPi, BoxFace::right}};
    for (const auto& [heading, face] : turns) {
      const SceneOwner scene = scene_of({make_box(agent_class, {12, 0, 0}, heading, {4, 4, 3})});
      const Drawn image = draw(no_geometry(), scene, {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
      expect_color(image.at(50, 52), agent_color(agent_class, face) * (1 - 10.0f / 120), 1e-4f);
    }
  }
}

TEST(CpuRenderer, FadesToBlackAtTheVisibleRange) {
  float last = 1;
  for (const float x : {5.0f, 30.0f, 60.0f, 90.0f, 119.0f}) {
    StaticGeometry geometry;
    WallFace wall;
    wall.a_m = {x, -5, 0};
    wall.b_m = {x, 5, 0};
    wall.height_m = 5;
    wall.color = {1, 1, 1};
    geometry.walls.push_back(wall);
    geometry.build_grids();
    const Drawn image = draw(geometry, scene_of({}), {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
    EXPECT_NEAR(image.at(50, 49).r, 1 - x / 120, 1e-5) << x;
    EXPECT_LT(image.at(50, 49).r, last);
    last = image.at(50, 49).r;
  }
  const SceneOwner far = scene_of({make_box(AgentClass::vehicle, {123, 0, 0}, 0, {4, 2, 5})});
  for (const float channel :
       draw(no_geometry(), far, {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1}).rgb) {
    ASSERT_EQ(channel, 0.0f);
  }
}

// Returns a mark 0.3 m wide along x, from 5 to 115 m ahead, 2 m to the left.
StaticGeometry long_mark() {
  StaticGeometry geometry;
  add_polyline(&geometry, {{5, 2, 0}, {115, 2, 0}}, 0.3f, StripKind::lane_mark);
  geometry.build_grids();
  return geometry;
}

// Returns the mark's width in a row: the sum of its coverage.
double row_coverage(const Drawn& image, int y) {
  double sum = 0;
  for (int x = 0; x < image.width_px; ++x) sum += image.at(x, y).r;
  return sum;
}

TEST(CpuRenderer, StripsTaperWithDepth) {
  // Without a floor, a row shows the strip with a width of 0.3 * f / depth, faded by its depth.
  const Drawn image = draw(long_mark(), scene_of({}), {make_view({}, 0)},
                           {.rig = simple_rig(200, 200, 100), .num_threads = 1, .line_floor_px = 0});
  for (const int y : {108, 112, 118}) {
    const double depth = 100 * 1.5 / (y + 0.5 - 100);
    // Brightness is that of a piece of 10 m, so its depth is at most 5 m off.
    const double expected = 0.3 * 100 / depth * kWhiteMarkColor.r;
    EXPECT_NEAR(row_coverage(image, y), expected * (1 - depth / 120), expected * 6.0 / 120) << y;
  }
}

TEST(CpuRenderer, TheFloorKeepsFarStripsVisible) {
  const StaticGeometry geometry = long_mark();
  auto far_row = [&](float floor_px) {
    return row_coverage(draw(geometry, scene_of({}), {make_view({}, 0)},
                             {.rig = simple_rig(100, 100), .num_threads = 1, .line_floor_px = floor_px}),
                        51);
  };
  EXPECT_GT(far_row(0.35f), 1.3 * far_row(0));
  EXPECT_GT(far_row(0.7f), 1.3 * far_row(0.35f));
}

TEST(CpuRenderer, TheFloorIsMeasuredAcrossTheStripOnScreen) {
  // A mark across the view 40 m ahead, 0.3 m wide: 50 * 1.5 * 0.3 / 1600 = 0.014 px high. The floor makes it 0.35.
  StaticGeometry geometry;
  add_polyline(&geometry, {{40, 9, 0}, {40, -1, 0}}, 0.3f, StripKind::stop_line);
  geometry.build_grids();
  const Drawn image = draw(geometry, scene_of({}), {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
  const float covered = (image.at(45, 51).b + image.at(45, 52).b) / (kStopLineColor.b * (1 - 40.0f / 120));
  EXPECT_NEAR(covered, 0.35f, 1e-3);
}

TEST(CpuRenderer, StripsAreClippedWhereTheirBordersCrossTheNearPlane) {
  // An eye 3 cm above a mark 2 m wide that passes the eye at 45 degrees. The mark's centre line crosses the near plane
  // 1.1 m to the left. Straight ahead the mark reaches from behind the near plane, 15 px below the centre, to 0.41 m
  // ahead.
  StaticGeometry geometry;
  add_polyline(&geometry, {{-2, -1, 0}, {2, 3, 0}}, 2.0f, StripKind::stop_line);
  geometry.build_grids();
  for (const float floor_px : {0.0f, 0.35f}) {
    const Drawn image = draw(geometry, scene_of({}), {make_view({0, 0, -1.47f}, 0)},
                             {.rig = simple_rig(), .num_threads = 1, .line_floor_px = floor_px});
    // The mark's two corners ahead are 2.71 and 1.29 m away.
    const Rgb color = kStopLineColor * (1 - 1.0f / 120);
    for (const int y : {54, 60, 64}) expect_color(image.at(50, y), color, 1e-4f);
    expect_color(image.at(50, 52), {});
    expect_color(image.at(50, 66), {});
  }
}

TEST(CpuRenderer, WideningAFarEndDoesNotChangeAStripAtTheNearPlane) {
  // An eye 3 cm above a mark that passes the eye at 38 degrees, looking down. The mark's end ahead, 4 m away, is
  // widened by 0.4 px on either side. If the mark moved as a whole, its sides near the camera would rise by half of the
  // eye's height.
  StaticGeometry geometry;
  add_polyline(&geometry, {{-3, -2.6f, 0}, {4.4f, 3.2f, 0}}, 0.3f, StripKind::stop_line);
  geometry.build_grids();
  Rig rig = simple_rig(100, 100, 50);
  rig.cameras[0].position_m = {};
  rig.cameras[0].pitch_rad = -0.5f;
  auto drawn = [&](float floor_px) {
    return draw(geometry, scene_of({}), {make_view({0, 0, 0.03f}, 0)},
                {.rig = rig, .num_threads = 1, .line_floor_px = floor_px});
  };
  const Drawn as_it_is = drawn(0), widened = drawn(1);
  double covered = 0, added = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      covered += as_it_is.at(x, y).b;
      added += std::abs(widened.at(x, y).b - as_it_is.at(x, y).b);
      if (y > 40) expect_color(widened.at(x, y), as_it_is.at(x, y), 1e-3f);
    }
  }
  EXPECT_GT(covered, 300);
  EXPECT_LT(added, 40);
}

TEST(CpuRenderer, FacesInOnePlaneLookTheSameInAMirroredScene) {
  // Three cars of one height, driven into each other: their tops are in one plane.
  auto crash = [](float sign) {
    Snapshot town;
    const Vec3 size{4.4f, 1.9f, 1.5f};
    town.scene = scene_of({make_box(AgentClass::vehicle, {9, sign * 0.3f, 0}, sign * 0.2f, size),
                           make_box(AgentClass::vehicle, {10, sign * -0.5f, 0}, sign * 1.1f, size),
                           make_box(AgentClass::vehicle, {11, sign * 0.9f, 0}, sign * -0.7f, size)});
    town.geometry = no_geometry();
    town.views = {make_view({0, 0, 2}, 0)};
    return town;
  };
  const auto renderer = make_renderer("cpu", {.rig = simple_rig(), .num_threads = 1});
  const Snapshot town = crash(1), mirrored = crash(-1);
  const std::vector<uint16_t> seen = draw_outputs(renderer.get(), town, Planes::all).instance_id,
                              seen_mirrored = draw_outputs(renderer.get(), mirrored, Planes::all).instance_id;
  int differing = 0, tops = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    tops += seen[i] != 0;
    differing += seen[i] != seen_mirrored[i / 100 * 100 + 99 - i % 100];
  }
  EXPECT_GT(tops, 300);
  EXPECT_EQ(differing, 0);
  const std::vector<VisibilityQuery> queries{{0, 0}, {0, 1}, {0, 2}};
  std::vector<float> visible(3), visible_mirrored(3);
  renderer->visibility(town.scene.batch(), town.views, queries, visible);
  renderer->visibility(mirrored.scene.batch(), mirrored.views, queries, visible_mirrored);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(visible[i], visible_mirrored[i], 0.01f) << i;
}

TEST(CpuRenderer, AMarkIsInFrontOfTheCarOnItWhenSeenFromBelow) {
  // The mark is on a bridge 4 m above the eye; the car's underside and the mark are in one plane.
  StaticGeometry geometry;
  add_polyline(&geometry, {{2, 0, 4}, {30, 0, 4}}, 0.8f, StripKind::stop_line);
  geometry.build_grids();
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {10, 0, 4}, 0.3f, {4, 2, 1})});
  const Drawn image = draw(geometry, scene, {make_view({0, 0, -1.5f}, 0)}, {.rig = simple_rig(), .num_threads = 1});
  for (const float ahead_m : {8.5f, 9.5f, 10.5f, 11.5f}) {
    const Rgb color = image.at(50, static_cast<int>(50 - 50 * 4 / ahead_m));
    EXPECT_LT(color.r, 0.6f * color.b) << ahead_m;
    EXPECT_GT(color.g, 0.5f * color.b) << ahead_m;
  }
}

TEST(CpuRenderer, LightsShowTheirStateOnlyToTheFront) {
  StaticGeometry geometry = no_geometry();
  LightHead head;
  head.position_m = {20, 0, 1.5f};
  head.facing = {-1, 0};
  head.signal = 1;
  geometry.heads.push_back(head);
  geometry.num_signals = 2;
  auto center = [&](LightState state, Vec3 eye, float heading) {
    SceneOwner scene;
    scene.light_states = {LightState::green, state};
    scene.end_world(0);
    return draw(geometry, scene, {make_view(eye, heading)}, {.rig = simple_rig(100, 100, 150), .num_threads = 1})
        .at(50, 50);
  };
  const float fade = 1 - 20.0f / 120;
  expect_color(center(LightState::red, {0, 0, 0}, 0), rgb8(255, 0, 0) * fade, 1e-4f);
  expect_color(center(LightState::yellow, {0, 0, 0}, 0), rgb8(255, 200, 0) * fade, 1e-4f);
  expect_color(center(LightState::off, {0, 0, 0}, 0), rgb8(80, 80, 80) * fade, 1e-4f);
  expect_color(center(LightState::unknown, {0, 0, 0}, 0), {});
  expect_color(center(LightState::red, {40, 0, 0}, kPi), {});  // from behind
  expect_color(center(LightState::off, {40, 0, 0}, kPi), {});
  EXPECT_GT(center(LightState::red, {10.5f, 16, 0}, atan2_of(-16, 9.5f)).r, 0.5f);     // 59 degrees off
  EXPECT_EQ(center(LightState::red, {11.0f, 16.5f, 0}, atan2_of(-16.5f, 9)).r, 0.0f);  // 61 degrees off
  // The disk's area: a circle of 0.5 m at 20 m is 3.75 px in radius.
  SceneOwner scene;
  scene.light_states = {LightState::off, LightState::red};
  scene.end_world(0);
  const Drawn image = draw(geometry, scene, {make_view({}, 0)}, {.rig = simple_rig(100, 100, 150), .num_threads = 1});
  double area = 0;
  for (int y = 0; y < 100; ++y) area += row_coverage(image, y);
  EXPECT_NEAR(area / fade, kPi * 3.75 * 3.75, 1e-3);
}

TEST(CpuRenderer, EgoHiddenAndUndrawnAgentsAreNotDrawn) {
  std::vector<AgentBox> boxes{make_box(AgentClass::vehicle, {0, 0, 0}, 0, {4.5f, 2, 1.5f}),
                              make_box(AgentClass::vehicle, {10, 0, 0}, 0, {4, 2, 1.5f}),
                              make_box(AgentClass::pedestrian, {8, 3, 0}, 0, {0.6f, 0.6f, 1.7f})};
  SceneOwner scene = scene_of(boxes);
  scene.hidden_agents = {2, 1};
  View view = make_view({}, 0);
  view.ego_agent = 0;
  View without = view;
  without.hidden_begin = 1;
  without.hidden_end = 2;
  const RendererConfig config{.rig = simple_rig(), .num_threads = 1};
  const Drawn images = draw(no_geometry(), scene, {view, without}, config);
  EXPECT_GT(images.at(50, 55, 0).b, 0.5f);
  EXPECT_EQ(images.at(50, 55, 1).b, 0.0f);
  EXPECT_GT(images.at(29, 52, 1).g, 0.5f);
  scene.agents[2].drawn = 0;
  EXPECT_EQ(draw(no_geometry(), scene, {without}, config).at(29, 52).g, 0.0f);
}

TEST(CpuRenderer, AViewCanHideAllAgentsOrAllLights) {
  StaticGeometry geometry = no_geometry();
  geometry.heads.push_back({.position_m = {20, 0, 3.5f}, .facing = {-1, 0}});
  geometry.num_signals = 1;
  SceneOwner scene;
  scene.agents = {make_box(AgentClass::vehicle, {10, 0, 0}, 0, {4, 2, 1.5f}),
                  make_box(AgentClass::pedestrian, {8, 3, 0}, 0, {0.6f, 0.6f, 1.7f})};
  scene.light_states = {LightState::red};
  scene.end_world(0);
  const auto drawn = [&](uint32_t hides, const std::vector<AgentBox>& agents, LightState light) {
    SceneOwner shown = scene;
    std::copy(agents.begin(), agents.end(), shown.agents.begin());
    shown.light_states[0] = light;
    View view = make_view({}, 0);
    view.hides = hides;
    return draw(geometry, shown, {view}, {.rig = simple_rig(), .num_threads = 1}).rgb;
  };
  std::vector<AgentBox> nowhere = scene.agents;
  for (AgentBox& box : nowhere) box.drawn = 0;
  const auto all = drawn(kHidesNothing, scene.agents, LightState::red);
  EXPECT_NE(drawn(kHidesAgents, scene.agents, LightState::red), all);
  EXPECT_NE(drawn(kHidesLights, scene.agents, LightState::red), all);
  EXPECT_EQ(drawn(kHidesAgents, scene.agents, LightState::red), drawn(kHidesNothing, nowhere, LightState::red));
  EXPECT_EQ(drawn(kHidesLights, scene.agents, LightState::red),
            drawn(kHidesNothing, scene.agents, LightState::unknown));
  EXPECT_EQ(drawn(kHidesAgents | kHidesLights, scene.agents, LightState::red),
            drawn(kHidesNothing, nowhere, LightState::unknown));
}

TEST(CpuRenderer, CamerasOfShortBodiesMoveInward) {
  Rig rig = simple_rig();
  rig.cameras[0].position_m.x = 1.6f;
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {12, 0, 0}, 0, {4, 2, 1})});
  View person = make_view({}, 0);
  person.body_length_m = 0.45f;  // the camera is 0.16 m ahead
  const Drawn one = draw(no_geometry(), scene, {person}, {.rig = rig, .num_threads = 1});
  rig.cameras[0].position_m.x = 0.16f;
  const Drawn other = draw(no_geometry(), scene, {make_view({}, 0)}, {.rig = rig, .num_threads = 1});
  for (std::size_t i = 0; i < one.rgb.size(); ++i) ASSERT_NEAR(one.rgb[i], other.rgb[i], 1e-5);
}

TEST(CpuRenderer, DrawsSizesFromOnePixelAndRigsOfMixedSizes) {
  Snapshot town = make_synthetic_town(7, 40);
  town.views.resize(3);
  Rig rig = paper_rig(1, 1);
  rig.cameras[1] = paper_rig(97, 55).cameras[1];
  rig.cameras[2] = paper_rig(20, 200).cameras[2];
  const auto renderer = make_renderer("cpu", {.rig = rig, .num_threads = 2});
  renderer->upload(0, town.geometry);
  HostImages images(rig, 3);
  for (uint8_t& byte : images.bytes()) byte = 0xAA;
  renderer->render(town.scene.batch(), town.views, images.batch());
  // Single cameras give the same images.
  for (int k = 0; k < 4; ++k) {
    Rig alone;
    alone.cameras = {rig.cameras[k]};
    const auto single = make_renderer("cpu", {.rig = alone, .num_threads = 1});
    single->upload(0, town.geometry);
    HostImages expected(alone, 3);
    single->render(town.scene.batch(), town.views, expected.batch());
    for (int view = 0; view < 3; ++view) EXPECT_EQ(images.interleaved(view, k), expected.interleaved(view, 0)) << k;
  }
}

TEST(CpuRenderer, LargeImagesAreDrawnInBandsWithoutSeams) {
  // A wall with a slanted top over 300 rows: every row's coverage follows the line.
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {6, 0, 0}, 0.5f, {4, 2, 1.6f})});
  const Drawn large =
      draw(no_geometry(), scene, {make_view({}, 0)}, {.rig = simple_rig(600, 600, 300), .num_threads = 1});
  const Drawn small = draw(no_geometry(), scene, {make_view({}, 0)}, {.rig = simple_rig(100, 100), .num_threads = 1});
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      Rgb mean;
      for (int j = 0; j < 6; ++j) {
        for (int i = 0; i < 6; ++i) {
          const Rgb fine = large.at(6 * x + i, 6 * y + j);
          mean = {mean.r + fine.r / 36, mean.g + fine.g / 36, mean.b + fine.b / 36};
        }
      }
      expect_color(small.at(x, y), mean, 1e-3f);
    }
  }
}

// Returns the value of an IEEE half.
float from_half(uint16_t bits) {
  const int exponent = bits >> 10, mantissa = bits & 1023;
  return exponent == 0 ? std::ldexp(static_cast<float>(mantissa), -24)
                       : std::ldexp(static_cast<float>(1024 + mantissa), exponent - 25);
}

TEST(CpuRenderer, HalvesAndBytesAreRoundedFloats) {
  for (int bits = 0; bits <= 0x3C00; ++bits) {
    const float value = from_half(static_cast<uint16_t>(bits));
    ASSERT_EQ(to_half(value), bits);
    // Ties between two halves round to even.
    if (bits == 0x3C00) break;
    const float middle = 0.5f * (value + from_half(static_cast<uint16_t>(bits + 1)));
    ASSERT_EQ(to_half(middle), bits + (bits & 1)) << bits;
    ASSERT_EQ(to_half(std::nextafter(middle, 1.0f)), bits + 1);
  }
  EXPECT_EQ(to_half(-1), 0);
  EXPECT_EQ(to_half(7), 0x3C00);
  Snapshot town = make_synthetic_town(9, 60);
  town.views.resize(2);
  const RendererConfig config{.rig = paper_rig(20, 11), .num_threads = 1};
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, town.geometry);
  HostImages floats(config.rig, 2, PixelFormat::f32), halves(config.rig, 2, PixelFormat::f16), bytes(config.rig, 2);
  for (HostImages* images : {&floats, &halves, &bytes}) {
    renderer->render(town.scene.batch(), town.views, images->batch());
  }
  const auto* as_float = reinterpret_cast<const float*>(floats.bytes().data());
  const auto* as_half = reinterpret_cast<const uint16_t*>(halves.bytes().data());
  for (std::size_t i = 0; i < bytes.bytes().size(); ++i) {
    ASSERT_EQ(as_half[i], to_half(as_float[i]));
    ASSERT_EQ(bytes.bytes()[i], to_byte(as_float[i]));
  }
}

TEST(CpuRenderer, PlanesHoldDepthClassAndInstance) {
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {30, -40, 0};
  wall.b_m = {30, 40, 0};
  wall.height_m = 4;
  geometry.walls.push_back(wall);
  add_polyline(&geometry, {{5, 5, 0}, {5, -5, 0}}, 1.0f, StripKind::stop_line);
  geometry.build_grids();
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {50, 0, 0}, 0, {4, 2, 1}),
                                     make_box(AgentClass::pedestrian, {10, 0, 0}, 0, {0.6f, 0.6f, 1.8f})});
  const RendererConfig config{.rig = simple_rig(), .num_threads = 1};
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, geometry);
  HostImages images(config.rig, 1);
  CameraImages out = images.camera(0);
  std::vector<float> depth(10000);
  std::vector<uint8_t> classes(10000);
  std::vector<uint16_t> instances(10000);
  out.depth_m = depth.data();
  out.class_id = classes.data();
  out.instance_id = instances.data();
  const std::vector<CameraImages> cameras{out};
  const std::vector<View> views{make_view({}, 0)};
  renderer->render(scene.batch(), views, {Device{}, PixelFormat::u8, 1, cameras});
  auto check = [&](int x, int y, double depth_m, int class_id, int instance) {
    const auto i = static_cast<std::size_t>(100 * y + x);
    if (std::isinf(depth_m)) {
      EXPECT_EQ(depth[i], std::numeric_limits<float>::infinity());
    } else {
      EXPECT_NEAR(depth[i], depth_m, 1e-3);
    }
    EXPECT_EQ(classes[i], class_id);
    EXPECT_EQ(instances[i], instance);
  };
  check(50, 5, std::numeric_limits<double>::infinity(), 0, 0);
  check(50, 52, 9.7, 3, 2);
  check(30, 51, 30, 4, 0);
  // The ground at row 64 is 50 * 1.5 / 14.5 m away; stop lines are the last kind of strip.
  check(50, 64, 50 * 1.5 / 14.5, kClassOfStrip + 3, 0);
}

TEST(CpuRenderer, VisibilityIsTheVisibleShare) {
  // A pillar of 1 m in front of the right half of a car's back; the same car next to it; a car outside the image.
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {10, 0, 0};
  wall.b_m = {10, -8, 0};
  wall.height_m = 8;
  geometry.walls.push_back(wall);
  geometry.build_grids();
  const SceneOwner scene = scene_of({make_box(AgentClass::vehicle, {22, 0, 0}, 0, {4, 2, 1.5f}),
                                     make_box(AgentClass::vehicle, {22, 6, 0}, 0, {4, 2, 1.5f}),
                                     make_box(AgentClass::vehicle, {22, -6, 0}, 0, {4, 2, 1.5f}),
                                     make_box(AgentClass::vehicle, {-20, 0, 0}, 0, {4, 2, 1.5f})});
  const auto renderer = make_renderer("cpu", {.rig = simple_rig(), .num_threads = 2});
  renderer->upload(0, geometry);
  const std::vector<View> views{make_view({}, 0)};
  const std::vector<VisibilityQuery> queries{{0, 0}, {0, 1}, {0, 2}, {0, 3}};
  std::vector<float> visibility(4);
  renderer->visibility(scene.batch(), views, queries, visibility);
  EXPECT_NEAR(visibility[0], 0.5, 1e-4);
  EXPECT_NEAR(visibility[1], 1.0, 1e-6);
  EXPECT_EQ(visibility[2], 0.0f);
  EXPECT_TRUE(std::isnan(visibility[3]));
}

std::unique_ptr<Renderer> make_cpu(const Rig& rig) { return make_renderer("cpu", {.rig = rig, .num_threads = 1}); }

TEST(CpuRenderer, KeepsMapsByHandle) {
  test::expect_maps_by_handle(make_cpu);
  test::expect_refused_handles(make_cpu);
  test::expect_refused_order(make_cpu);
}

TEST(CpuRenderer, DrawsPatches) { test::expect_patches(make_cpu); }

TEST(CpuRenderer, DrawsTheCountedViews) {
  test::expect_counted_views(make_cpu);
  test::expect_counted_queries(make_cpu);
}

class CpuRendererErrors : public testing::Test {
 protected:
  void SetUp() override {
    renderer_ = make_renderer("cpu", {.rig = paper_rig(8, 8), .num_threads = 1});
    renderer_->upload(0, no_geometry());
    scene_ = scene_of({make_box(AgentClass::vehicle, {5, 0, 0}, 0, {4, 2, 1})});
    views_ = {make_view({}, 0)};
  }
  void expect_error(const char* what) {
    EXPECT_THAT(test::message_of([this] { renderer_->render(scene_.batch(), views_, images_.batch()); }),
                HasSubstr(what));
  }
  std::unique_ptr<Renderer> renderer_;
  SceneOwner scene_;
  std::vector<View> views_;
  HostImages images_{paper_rig(8, 8), 1};
};

TEST_F(CpuRendererErrors, ValidInputIsAccepted) {
  EXPECT_NO_THROW(renderer_->render(scene_.batch(), views_, images_.batch()));
  HostImages none(paper_rig(8, 8), 0);
  EXPECT_NO_THROW(renderer_->render({}, {}, none.batch()));
}
TEST_F(CpuRendererErrors, ImagesOfAnotherSpaceSizeOrNumber) {
  ImageBatch images = images_.batch();
  images.device = {MemorySpace::cuda, 1};
  EXPECT_THAT(test::message_of([&] { renderer_->render(scene_.batch(), views_, images); }),
              HasSubstr("renderer cpu: images: expected cpu, got cuda:1"));
  images_ = HostImages(paper_rig(8, 9), 1);
  expect_error("8x9");
  images_ = HostImages(paper_rig(8, 8), 2);
  expect_error("1 views");
  Rig three = paper_rig(8, 8);
  three.cameras.pop_back();
  images_ = HostImages(three, 1);
  expect_error("4 cameras");
}
TEST_F(CpuRendererErrors, ScenesInDeviceMemory) {
  SceneBatch scene = scene_.batch();
  scene.device = {MemorySpace::cuda, 0};
  EXPECT_THAT(test::message_of([&] { renderer_->render(scene, views_, images_.batch()); }),
              HasSubstr("renderer cpu: scene: expected cpu, got cuda:0"));
}
TEST_F(CpuRendererErrors, HandlesAndIndicesOutOfRange) {
  views_[0].world = 1;
  expect_error("world below 1");
  views_[0] = make_view({}, 0);
  views_[0].ego_agent = 1;
  expect_error("ego below 1");
  views_[0] = make_view({}, 0);
  views_[0].hidden_end = 3;
  expect_error("hidden agents");
  views_[0] = make_view({}, 0);
  scene_.geometry[0] = 4;
  expect_error("world 0: expected a handle that holds a geometry, got 4");
  scene_.geometry[0] = 0;
  scene_.world_begin = {0, 2};
  expect_error("world_begin");
  scene_.world_begin = {0, 1};
  scene_.hidden_agents = {0, 1};
  expect_error("hidden agent 1: expected an index below 1, got 1");
  scene_.hidden_agents.clear();
  scene_.agents.resize(kMaxBoxesPerWorld + 1, scene_.agents[0]);
  scene_.world_begin = {0, kMaxBoxesPerWorld + 1};
  expect_error("world 0: expected at most 8192 agents, got 8193");
}
TEST_F(CpuRendererErrors, PosesThatAreNotFinite) {
  views_[0].origin_m.y = std::numeric_limits<float>::quiet_NaN();
  expect_error("finite pose");
  views_[0] = make_view({}, 0);
  views_[0].cos_heading = 0;
  expect_error("finite pose");
  views_[0] = make_view({}, 0);
  scene_.agents[0].center_m.x = std::numeric_limits<float>::infinity();
  expect_error("agent 0");
  scene_.agents[0].drawn = 0;  // an undrawn agent may be anywhere
  EXPECT_NO_THROW(renderer_->render(scene_.batch(), views_, images_.batch()));
}
TEST_F(CpuRendererErrors, QueriesAndGeometryAndConfig) {
  const std::vector<VisibilityQuery> queries{{0, 7}};
  std::vector<float> visibility(1);
  EXPECT_THROW(renderer_->visibility(scene_.batch(), views_, queries, visibility), Error);
  // The agent is in another world.
  scene_.agents.push_back(scene_.agents[0]);
  scene_.end_world(0);
  const std::vector<VisibilityQuery> of_another{{0, 1}};
  EXPECT_THROW(renderer_->visibility(scene_.batch(), views_, of_another, visibility), Error);
  EXPECT_THROW(make_renderer("cpu", {.rig = paper_rig(8, 8), .line_floor_px = -1}), Error);
  EXPECT_THROW(make_renderer("cpu", {.rig = {}}), Error);
}
TEST_F(CpuRendererErrors, InvalidGeometry) {
  StaticGeometry sound = no_geometry();
  sound.strips.push_back({{0, 0, 0}, {1, 0, 0}, {0, 1}, {0, 1}, 0.2f, kWhiteMarkColor});
  sound.walls.push_back({{0, 0, 0}, {1, 0, 0}, 2.0f});
  sound.heads.push_back({{0, 0, 5}, {1, 0}});
  sound.num_signals = 1;
  sound.build_grids();
  EXPECT_NO_THROW(renderer_->upload(0, sound));
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  struct Case {
    const char* expected_message;
    void (*spoil)(StaticGeometry*);
  };
  const Case cases[] = {
      {"strip 0: expected finite ends", [](StaticGeometry* g) { g->strips[0].a_m.z = kNone; }},
      {"strip 0: expected a colour of 0 to 1", [](StaticGeometry* g) { g->strips[0].color.g = kNone; }},
      {"strip 0: expected a colour of 0 to 1", [](StaticGeometry* g) { g->strips[0].color.r = 1.5f; }},
      {"strip 0: expected a kind below 4", [](StaticGeometry* g) { g->strips[0].kind = static_cast<StripKind>(4); }},
      {"wall 0: expected finite ends", [](StaticGeometry* g) { g->walls[0].height_m = -1; }},
      {"wall 0: expected a colour of 0 to 1", [](StaticGeometry* g) { g->walls[0].color.b = -0.1f; }},
      {"light head 0: expected a finite position", [](StaticGeometry* g) { g->heads[0].facing = {}; }},
      {"light head 0: expected the cosine", [](StaticGeometry* g) { g->heads[0].cos_half_angle = kNone; }},
      {"light head 0: expected a signal below 1, got 1", [](StaticGeometry* g) { g->heads[0].signal = 1; }},
      {"built from all 2 strips, got a grid of 1", [](StaticGeometry* g) { g->strips.push_back(g->strips[0]); }},
      {"built from all 0 walls, got a grid of 1", [](StaticGeometry* g) { g->walls.clear(); }},
  };
  for (const Case& each : cases) {
    StaticGeometry geometry = sound;
    each.spoil(&geometry);
    EXPECT_THAT(test::message_of([&] { renderer_->upload(0, geometry); }), HasSubstr(each.expected_message));
  }
}

// A widened strip may cover pixels at which the strip's plane is behind the camera.
TEST(CpuRenderer, AWidenedStripCoversEqualPixelsInPlanesAndImage) {
  Snapshot town;
  Strip strip = {{60, -6, 1.4999f}, {62, 6, 1.49f}, {0.98f, -0.16f}, {0.98f, -0.16f}, 0.15f, kWhiteMarkColor};
  town.geometry.strips.push_back(strip);
  town.geometry.build_grids();
  town.scene.end_world(0);
  const Rig rig = front_rig();
  int drawn = 0;
  for (int i = -40; i <= 40; ++i) {
    town.views = {make_view({0, 0, 0.0005f * static_cast<float>(i)}, 0)};
    const auto renderer = make_renderer("cpu", {.rig = rig, .num_threads = 1, .line_floor_px = 8});
    const Outputs out = draw_outputs(renderer.get(), town, Planes::all);
    const std::size_t pixels = out.class_id.size();
    for (std::size_t at = 0; at < pixels; ++at) {
      if (out.color[at] < 0.45f * strip.color.r) continue;  // less than about a whole pixel at half brightness
      ++drawn;
      EXPECT_NE(out.class_id[at], 0) << "height " << i << ", pixel " << at;
      EXPECT_TRUE(std::isfinite(out.depth_m[at])) << "height " << i << ", pixel " << at;
    }
  }
  EXPECT_GT(drawn, 0);
}

}  // namespace
}  // namespace pictura
