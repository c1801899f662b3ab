// The rig of the Pictura paper, camera axes, and rigs that are read from files.
#include "pictura/common/camera.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::message_of;
using testing::HasSubstr;

std::string written(const std::string& text) {
  const std::string path =
      testing::TempDir() + "/pictura_rig_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
  std::ofstream(path) << text;
  return path;
}

TEST(Rig, ThePapersRigHasItsFieldOfView) {
  const Rig rig = paper_rig();
  ASSERT_EQ(rig.cameras.size(), 4u);
  const Camera& front = rig.cameras[0];
  EXPECT_EQ(front.width_px, 96);
  EXPECT_EQ(front.height_px, 54);
  EXPECT_NEAR(2 * std::atan(0.5 * front.width_px / front.focal_x_px) * 180 / 3.14159265, 63.7, 0.05);
  EXPECT_NEAR(2 * std::atan(0.5 * front.height_px / front.focal_y_px) * 180 / 3.14159265, 38.5, 0.05);
  EXPECT_FLOAT_EQ(rig.cameras[1].yaw_rad, 55.0f * kPi / 180.0f);
  EXPECT_FLOAT_EQ(rig.cameras[3].position_m.x, -0.47f);
}

TEST(Camera, AxesFollowYawAndPitch) {
  Camera camera;
  camera.yaw_rad = kHalfPi;  // faces left
  CameraAxes axes = camera_axes(camera);
  EXPECT_NEAR(axes.forward.y, 1, 1e-6);
  EXPECT_NEAR(axes.right.x, 1, 1e-6);
  EXPECT_NEAR(axes.down.z, -1, 1e-6);
  camera.yaw_rad = 0;
  camera.pitch_rad = 0.1f;  // faces up
  axes = camera_axes(camera);
  EXPECT_NEAR(axes.forward.z, std::sin(0.1), 1e-6);
  EXPECT_NEAR(axes.down.x, std::sin(0.1), 1e-6);
  EXPECT_NEAR(dot(axes.right, axes.down), 0, 1e-6);
}

/// Axes by vectors instead of rotations.
void expect_axes(const Camera& camera) {
  const double yaw = camera.yaw_rad, pitch = camera.pitch_rad, roll = camera.roll_rad;
  const double forward[3] = {std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch)};
  const double level_right[3] = {std::sin(yaw), -std::cos(yaw), 0};
  const double level_down[3] = {std::cos(yaw) * std::sin(pitch), std::sin(yaw) * std::sin(pitch), -std::cos(pitch)};
  const CameraAxes axes = camera_axes(camera);
  const float actual[3][3] = {{axes.right.x, axes.right.y, axes.right.z},
                              {axes.down.x, axes.down.y, axes.down.z},
                              {axes.forward.x, axes.forward.y, axes.forward.z}};
  for (int i = 0; i < 3; ++i) {
    constexpr double kRounding = 3e-8;  // half a unit in the last place below 1
    EXPECT_NEAR(actual[0][i], level_right[i] * std::cos(roll) + level_down[i] * std::sin(roll), kRounding);
    EXPECT_NEAR(actual[1][i], level_down[i] * std::cos(roll) - level_right[i] * std::sin(roll), kRounding);
    EXPECT_NEAR(actual[2][i], forward[i], kRounding);
  }
}

TEST(Camera, AxesAreRoundedOnce) {
  for (int i = 0; i < 1000; ++i) {
    Camera camera;
    camera.yaw_rad = radians_of(0.71 * i - 355);
    camera.pitch_rad = radians_of(0.17 * i - 85);
    camera.roll_rad = radians_of(0.37 * i - 185);
    expect_axes(camera);
  }
}

TEST(Camera, LevelCamerasAreLevelToTheBit) {
  for (int degrees = -360; degrees <= 360; ++degrees) {
    Camera camera;
    camera.yaw_rad = radians_of(degrees);
    const CameraAxes axes = camera_axes(camera);
    EXPECT_EQ(axes.right.z, 0) << degrees;
    EXPECT_EQ(axes.forward.z, 0) << degrees;
    EXPECT_EQ(axes.down.z, -1) << degrees;
    EXPECT_EQ(length(axes.down.xy()), 0) << degrees;
  }
}

TEST(Rig, ARigFileIsRead) {
  const Rig rig =
      load_rig(written("[[camera]]\nname = \"wide\"\nwidth_px = 64\nheight_px = 32\nfocal_px = 30\nx_m = 1.5\n"
                       "z_m = 1.4\nyaw_deg = 90\n\n[[camera]]\nwidth_px = 97\nheight_px = 55\nfocal_px = 80.5\n"));
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[0].name, "wide");
  EXPECT_FLOAT_EQ(rig.cameras[0].yaw_rad, kHalfPi);
  EXPECT_FLOAT_EQ(rig.cameras[0].center_x_px, 32);
  EXPECT_EQ(rig.cameras[1].width_px, 97);
}

TEST(Rig, ErrorsNameTheFaultOfARig) {
  EXPECT_THAT(
      message_of([] { load_rig(written("[[camera]]\nname = \"a\"\nwidth_px = 0\nheight_px = 0\nfocal_px = 3\n")); }),
      HasSubstr(".toml:3: camera 0 'a': width_px: expected an integer in [1, 8192], got 0"));
  EXPECT_THAT(message_of([] { load_rig(written("[[camera]]\nwidth_px = 8\nheight_px = 8\nfocal_px = -3\n")); }),
              HasSubstr("focal_px: expected a number in [0.001, 1000000], got -3"));
  EXPECT_THAT(
      message_of([] { load_rig(written("[[camera]]\nwidth_px = 8\nheight_px = 8\nfocal_px = 3\nzoom = 2\n")); }),
      HasSubstr("unknown key 'zoom'"));
  EXPECT_THAT(message_of([] { load_rig(written("[[camera]]\nwidth_px = nan\nheight_px = 8\nfocal_px = 3\n")); }),
              HasSubstr("got nan"));
  EXPECT_THAT(message_of([] { load_rig(written("[[camera]]\nwidth_px = 8\nheight_px = 8\n")); }),
              HasSubstr(":1: camera 0 'camera0': focal_px: is missing"));
  EXPECT_THAT(message_of([] { load_rig(written("[[camera]]\nname = '../a'\n")); }), HasSubstr("'../a'"));
  EXPECT_THAT(message_of([] {
                const std::string one = "[[camera]]\nname = 'a'\nwidth_px = 8\nheight_px = 8\nfocal_px = 9\n";
                load_rig(written(one + one));
              }),
              HasSubstr("'a' is already used"));
  EXPECT_THAT(message_of([] { load_rig(written("[[camera\n")); }), HasSubstr(":1: "));
  EXPECT_THAT(message_of([] { load_rig(written("x = 1\n")); }), HasSubstr("unknown key 'x'"));
  EXPECT_THAT(message_of([] { load_rig(written("\n")); }), HasSubstr("[[camera]]"));
  EXPECT_THAT(message_of([] { load_rig("/no/such/rig.toml"); }), HasSubstr("/no/such/rig.toml: no such file"));
  EXPECT_THAT(message_of([] { paper_rig(0, 54); }), HasSubstr("got 0x54"));
}

}  // namespace
}  // namespace pictura
