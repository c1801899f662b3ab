// Occluders: what they hide and what not, which of a scene's walls are taken, and that towns look the same
// with and without them.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/backend_cpu/renderer_cpu_image.h"
#include "pictura/bench/quality.h"
#include "pictura/common/camera.h"
#include "pictura/common/raster_check.h"
#include "pictura/map/load_map.h"

namespace pictura {
namespace {

/// A camera at (0, 0, 1.5) that looks along x: 96x54 pixels of 1/48 of a radian in the middle.
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

bool occlude(const ImageSetting& setting, const WallFace& wall, Occluder* out) {
  CameraQuad seen;
  return see_quad(wall_quad(wall), setting.camera, &seen) && make_occluder(setting.camera, setting.frustum, seen, out);
}

WallFace wall_between(Vec3 a_m, Vec3 b_m, float height_m = 6) { return {a_m, b_m, height_m}; }

/// Whether a wall hides a strip's face.
bool hides(const WallFace& wall, Vec3 a_m, Vec3 b_m) {
  ImageSetting setting = setting_ahead();
  Occluder occluder;
  if (occlude(setting, wall, &occluder)) setting.occluders.offer(occluder, 0);
  ScreenBounds bounds;
  for (const Vec3 corner_m : {a_m, b_m}) {
    const Vec3 corner = to_camera(setting.camera, corner_m);
    bounds.add(project(setting.camera, corner, inverse_of(corner.z)), inverse_of(corner.z));
  }
  return setting.occluders.hide(setting.camera, bounds);
}

TEST(Occluders, HideWhatIsBehindThemInDepthAndOnScreen) {
  const WallFace wall = wall_between({20, -6, 0}, {20, 6, 0});
  EXPECT_TRUE(hides(wall, {40, -4, 0}, {50, 4, 0}));
  EXPECT_TRUE(hides(wall_between({20, 6, 0}, {20, -6, 0}), {40, -4, 0}, {50, 4, 0})) << "the other way round";
  EXPECT_TRUE(hides(wall, {21, -4, 1}, {21, 4, 1}));
  EXPECT_FALSE(hides(wall, {18, -4, 0}, {18, 4, 0})) << "before it";
  EXPECT_FALSE(hides(wall, {18, -4, 1}, {40, 4, 0})) << "through it";
  EXPECT_FALSE(hides(wall, {40, -4, 0}, {50, 16, 0})) << "past its side";
  EXPECT_FALSE(hides(wall, {40, -4, 0}, {50, 4, 20})) << "above it";
  EXPECT_FALSE(hides(wall_between({20, -6, 1}, {20, 6, 1}), {21, -4, 0}, {21, 4, 0})) << "below it";
  EXPECT_FALSE(hides(wall_between({20, -6, 0}, {-20, 6, 0}), {40, -4, 0}, {50, 4, 0})) << "behind the camera, partly";
  EXPECT_FALSE(hides(wall_between({130, -60, 0}, {130, 60, 0}), {140, -4, 0}, {141, 4, 0})) << "black";
}

TEST(Occluders, AreThoseThatCoverMost) {
  const ImageSetting setting = setting_ahead();
  std::vector<Occluder> walls(4);
  const float distances_m[] = {30, 10, 40, 20};
  for (std::size_t i = 0; i < walls.size(); ++i) {
    ASSERT_TRUE(occlude(setting, wall_between({distances_m[i], -3, 0}, {distances_m[i], 3, 0}), &walls[i]));
  }
  Occluders occluders;
  for (int32_t i = 0; i < 4; ++i) {
    const Occluder& wall = walls[static_cast<std::size_t>(i)];
    EXPECT_EQ(occluders.wants(wall.covered_px2, i), i != 2) << i;
    occluders.offer(wall, i);
  }
  // Those at 10 and 20 m: of two that cover as much, the lower index.
  EXPECT_FALSE(occluders.wants(walls[3].covered_px2, 4));
  EXPECT_TRUE(occluders.wants(walls[3].covered_px2, 2));
}

class OccludersOfTowns : public testing::TestWithParam<const char*> {};

TEST_P(OccludersOfTowns, ChangeNothingThatIsSeen) {
  const std::string map = GetParam();
  const std::vector<std::string> towns = known_towns();
  if (map.starts_with("Town") && !std::binary_search(towns.begin(), towns.end(), map)) {
    GTEST_SKIP() << "needs " << map << ".xodr; set PICTURA_DATA";
  }
  const Snapshot snapshot = drive_snapshot({.map = map, .views = 24});
  const StaticGeometryView pieces = snapshot.geometry.view();
  const SceneBatch scene = snapshot.scene.batch();
  const std::vector<PinholeCamera> cameras = pinhole_cameras(paper_rig());
  ImageDrawer drawer;
  // Fragments that are hidden as a whole weigh nothing, but what is added up beside them is rounded; and slivers that
  // fill a pixel together with a wall show a little.
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
                         [](const auto& map) {
                           std::string name = map.param;
                           std::replace(name.begin(), name.end(), ':', '_');
                           return name;
                         });

}  // namespace
}  // namespace pictura
