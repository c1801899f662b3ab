// Occluders: the faces that they occlude, the walls of a scene that are chosen as occluders, and equal images of towns
// with and without occlusion culling.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/backend_cpu/renderer/image_drawer.h"
#include "pictura/bench/quality.h"
#include "pictura/common/camera.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/check.h"
#include "pictura/tests/support/image_drawing.h"
#include "pictura/tests/support/named_maps.h"

namespace pictura {
namespace {

/// A camera at (0, 0, 1.5) that faces along x: 96x54 pixels of 1/48 of a radian in the middle.
ImageSetting setting_ahead() {
  Camera camera = paper_rig().cameras[0];
  camera.position_m = {0, 0, 1.5f};
  camera.yaw_rad = camera.pitch_rad = camera.roll_rad = 0;
  Rig rig;
  rig.cameras = {camera};
  ImageSetting setting;
  setting.camera = place_camera(pinhole_cameras(rig)[0], make_view({}, 0));
  setting.frustum = make_frustum(setting.camera);
  return setting;
}

WallFace wall_between(Vec3 a_m, Vec3 b_m, float height_m = 6) { return {a_m, b_m, height_m}; }

/// A setting_ahead() with a wall as its occluder, where the wall can be one.
ImageSetting setting_with(const WallFace& wall) {
  ImageSetting setting = setting_ahead();
  CameraQuad face;
  ScreenQuad quad;
  bool is_clockwise = false;
  if (quad_to_camera(wall_quad(wall), setting.camera, &face) &&
      occluder_area_px2(setting.camera, face, &quad, &is_clockwise) > 0) {
    setting.occluders.occluder[0] = make_occluder(setting.camera, setting.frustum, face.plane, quad, is_clockwise);
    setting.occluders.count = 1;
  }
  return setting;
}

/// Whether a wall, as an occluder, occludes the bounds of two points.
bool occludes(const WallFace& wall, Vec3 a_m, Vec3 b_m) {
  const ImageSetting setting = setting_with(wall);
  ScreenBounds bounds;
  for (const Vec3 corner_m : {a_m, b_m}) {
    const Vec3 corner = to_camera(setting.camera, corner_m);
    bounds.add(project(setting.camera, corner, reciprocal_in_range(corner.z)), reciprocal_in_range(corner.z));
  }
  return setting.occluders.occludes(setting.camera, bounds);
}

TEST(Occluders, OccludeObjectsBehindThem) {
  const WallFace wall = wall_between({20, -6, 0}, {20, 6, 0});
  EXPECT_TRUE(occludes(wall, {40, -4, 0}, {50, 4, 0}));
  EXPECT_TRUE(occludes(wall_between({20, 6, 0}, {20, -6, 0}), {40, -4, 0}, {50, 4, 0})) << "the other way round";
  EXPECT_TRUE(occludes(wall, {21, -4, 1}, {21, 4, 1}));
  EXPECT_FALSE(occludes(wall, {18, -4, 0}, {18, 4, 0})) << "before it";
  EXPECT_FALSE(occludes(wall, {18, -4, 1}, {40, 4, 0})) << "through it";
  EXPECT_FALSE(occludes(wall, {40, -4, 0}, {50, 16, 0})) << "past its side";
  EXPECT_FALSE(occludes(wall, {40, -4, 0}, {50, 4, 20})) << "above it";
  EXPECT_FALSE(occludes(wall_between({20, -6, 1}, {20, 6, 1}), {21, -4, 0}, {21, 4, 0})) << "below it";
  EXPECT_FALSE(occludes(wall_between({20, -6, 0}, {-20, 6, 0}), {40, -4, 0}, {50, 4, 0}))
      << "behind the camera, partly";
  EXPECT_FALSE(occludes(wall_between({130, -60, 0}, {130, 60, 0}), {140, -4, 0}, {141, 4, 0})) << "black";
}

TEST(Occluders, OccludeAStripSeenFromBelowUnlessTheyStandOnIt) {
  // A wall at 20 m and level strips behind it. Three are 3 m above the eye, so that solids on them are at most three
  // times nearer; one, below the eye, is hidden in any case.
  const ImageSetting setting = setting_with(wall_between({20, -6, 0}, {20, 6, 0}));
  for (const auto& [distance_m, z_m, is_visible] :
       {std::tuple{30.0f, 4.5f, true}, {58.0f, 4.5f, true}, {62.0f, 4.5f, false}, {30.0f, 0.0f, false}}) {
    Strip strip;
    strip.a_m = {distance_m, 0, z_m};
    strip.b_m = {distance_m + 20, 0, z_m};
    strip.side_a = strip.side_b = {0, 1};
    strip.width_m = 3;
    strip.kind = StripKind::crosswalk;
    CameraQuad face;
    ScreenQuad quad;
    bool is_clockwise = false;
    ASSERT_TRUE(quad_to_camera(strip_quad(strip), setting.camera, &face));
    ASSERT_EQ(project_quad(setting.camera, face.corner, 0, &quad), ClipClass::inside);
    EXPECT_EQ(is_quad_visible(setting, quad, face.plane, face.color, strip_ref(strip, 0), &is_clockwise), is_visible)
        << distance_m;
  }
}

TEST(Occluders, HaveTheLargestCoverage) {
  // Walls of one size at different distances, and a box's side that covers as much as a wall at 10 m; also walls
  // outside the frame, behind the camera, and black.
  StaticGeometry geometry;
  for (const float distance_m : {60.0f, 20.0f, 50.0f, 40.0f, 30.0f, -20.0f, 130.0f}) {
    geometry.walls.push_back(wall_between({distance_m, -3, 0}, {distance_m, 3, 0}));
  }
  geometry.walls.push_back(wall_between({20, 60, 0}, {20, 66, 0}));
  geometry.build_grids();
  const auto scene = scene_of({make_box(AgentClass::vehicle, {12.25f, 0, 0}, 0, {4.5f, 2, 1.6f})});
  const View view = make_view({}, 0);
  const SceneBatch batch = scene.batch();
  const CulledGeometry pieces(geometry.view());
  ImageDrawer drawer;
  drawer.prepare({&pieces, &batch, &view, setting_ahead().camera});
  const Occluders& occluders = drawer.occluders();
  ASSERT_EQ(occluders.count, Occluders::kMaxCount);
  const float distances_m[] = {20, 30, 10, 40};
  for (int i = 0; i < occluders.count; ++i) {
    EXPECT_NEAR(1 / occluders.occluder[i].inverse_depth.z, distances_m[i], 1e-3f) << i;
  }
}

class OccludersOfTowns : public testing::TestWithParam<const char*> {};

TEST_P(OccludersOfTowns, DoNotChangeTheImage) {
  const std::string map = GetParam();
  if (const std::string why = test::missing(map); !why.empty()) GTEST_SKIP() << why;
  const Snapshot snapshot = drive_snapshot({.map = map, .views = 24});
  const CulledGeometry pieces(snapshot.geometry.view());
  const SceneBatch scene = snapshot.scene.batch();
  const std::vector<PinholeCamera> cameras = pinhole_cameras(paper_rig());
  ImageDrawer drawer;
  // Fully occluded fragments have weight 0, but other weights are rounded differently; and slivers that fill a pixel
  // together with a wall are slightly visible.
  constexpr float kRounding = 1e-6f, kWorst = 4.0f / 255.0f;
  std::size_t differing = 0, values = 0;
  float worst = 0;
  for (const View& view : snapshot.views) {
    for (const PinholeCamera& camera : cameras) {
      std::vector<float> images[2];
      for (const bool leaves_out : {false, true}) {
        std::vector<float>& image = images[leaves_out ? 1 : 0];
        image.resize(3 * static_cast<std::size_t>(camera.width_px * camera.height_px));
        drawer.prepare({&pieces, &scene, &view, place_camera(camera, view), 0.35f, false, leaves_out});
        drawer.draw({PixelFormat::f32, image.data()});
      }
      values += images[0].size();
      for (std::size_t i = 0; i < images[0].size(); ++i) {
        const float off = std::abs(images[0][i] - images[1][i]);
        differing += off > kRounding ? 1 : 0;
        worst = std::max(worst, off);
      }
    }
  }
  fmt::print("{}: {} of {} values, at most {:.2f}/255\n", map, differing, values, 255 * worst);
  EXPECT_LE(static_cast<double>(differing), 1e-4 * static_cast<double>(values));
  EXPECT_LE(worst, kWorst);
}

INSTANTIATE_TEST_SUITE_P(Maps, OccludersOfTowns,
                         testing::Values("Town01", "Town03", "Town05", "Town07", "Town10HD", "procedural:1"),
                         test::map_name);

}  // namespace
}  // namespace pictura
