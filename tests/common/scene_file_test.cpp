// Scene files: each table, and errors for bad files.
#include "pictura/common/scene_file.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using testing::HasSubstr;

const std::string kView = "[[view]]\nx_m = 1.0\ny_m = 2.0\nheading_deg = 90.0\n";
const std::string kAgent =
    "[[agent]]\nclass = 'cyclist'\nx_m = 5.0\ny_m = -1.0\nheading_deg = 180.0\nlength_m = 1.8\nwidth_m = 0.6\n"
    "height_m = 1.7\n";

std::string parse_error(const std::string& text) {
  return test::message_of([&] { parse_scene(text, "s.toml"); });
}

TEST(SceneFile, TheSmallestSceneIsAView) {
  const SceneFile scene = parse_scene(kView, "s.toml");
  ASSERT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(scene.views[0].origin_m.x, 1);
  EXPECT_EQ(scene.views[0].origin_m.y, 2);
  EXPECT_NEAR(scene.views[0].sin_heading, 1, 1e-6);
  EXPECT_EQ(scene.views[0].ego_agent, -1);
  EXPECT_EQ(scene.views[0].body_length_m, View::kRigBodyLength_m);
  EXPECT_EQ(scene.view_names[0], "view0");
  EXPECT_EQ(scene.config.rig.cameras.size(), 4u);
  EXPECT_EQ(scene.config.rig.cameras[0].width_px, 96);
  EXPECT_EQ(scene.config.line_floor_px, RendererConfig{}.line_floor_px);
  EXPECT_EQ(scene.scene.world_begin, (std::vector<int32_t>{0, 0}));
}

TEST(SceneFile, AgentsViewsAndSettings) {
  const SceneFile scene = parse_scene("size_px = [33, 21]\nline_floor_px = 0.5\ndebug_palette = true\n" + kAgent +
                                          "palette = 'parked'\ndrawn = false\n" + kAgent + kView +
                                          "ego = 1\nhidden = [0, 1]\nname = 'from-1'\ncaption = \"the second's\"\n" +
                                          kView + "hidden = [1]\nbody_length_m = 3.0\n",
                                      "s.toml");
  EXPECT_EQ(scene.config.rig.cameras[3].height_px, 21);
  EXPECT_EQ(scene.config.line_floor_px, 0.5f);
  EXPECT_TRUE(scene.config.debug_palette);
  const AgentBox& box = scene.scene.agents[0];
  EXPECT_EQ(box.agent_class, AgentClass::cyclist);
  EXPECT_EQ(box.palette, 2);
  EXPECT_EQ(box.drawn, 0);
  EXPECT_NEAR(box.cos_heading, -1, 1e-6);
  EXPECT_EQ(box.height_m, 1.7f);
  EXPECT_EQ(scene.scene.agents[1].drawn, 1);
  EXPECT_EQ(scene.views[0].ego_agent, 1);
  EXPECT_EQ(scene.views[0].body_length_m, 1.8f);
  EXPECT_EQ(scene.views[0].hidden_end, 2);
  EXPECT_EQ(scene.views[1].hidden_begin, 2);
  EXPECT_EQ(scene.views[1].hidden_end, 3);
  EXPECT_EQ(scene.views[1].body_length_m, 3);
  EXPECT_EQ(scene.scene.hidden_agents, (std::vector<int32_t>{0, 1, 1}));
  EXPECT_EQ(scene.view_names, (std::vector<std::string>{"from-1", "view1"}));
  EXPECT_EQ(scene.view_captions[0], "the second's");
}

TEST(SceneFile, WallsAndLights) {
  const SceneFile scene =
      parse_scene(kView +
                      "[[wall]]\npoints_m = [[0, 1], [2, 3, 1], [4, 5]]\nheight_m = 2.5\n"
                      "[[wall]]\npoints_m = [[0, 1], [2, 3]]\nheight_m = 1\ncolor_rgb = [255, 51, 0]\n"
                      "[[light]]\nx_m = 7\ny_m = 8\nz_m = 5\nfacing_deg = -90\nstate = 'yellow'\nhalf_angle_deg = 90\n"
                      "[[light]]\nx_m = 7\ny_m = 8\nfacing_deg = 0\nstate = 'off'\n"
                      "[[light]]\nx_m = 9\ny_m = 8\nfacing_deg = 0\nstate = 'unknown'\n",
                  "s.toml");
  ASSERT_EQ(scene.geometry.walls.size(), 3u);
  EXPECT_EQ(scene.geometry.walls[0].b_m.z, 1);
  EXPECT_EQ(scene.geometry.walls[1].a_m.x, 2);
  EXPECT_EQ(scene.geometry.walls[1].color.r, kWallColor.r);
  EXPECT_EQ(scene.geometry.walls[2].color.g, 0.2f);
  ASSERT_EQ(scene.geometry.heads.size(), 3u);
  EXPECT_EQ(scene.geometry.num_signals, 3);
  EXPECT_NEAR(scene.geometry.heads[0].facing.y, -1, 1e-6);
  EXPECT_NEAR(scene.geometry.heads[0].cos_half_angle, 0, 1e-6);
  EXPECT_NEAR(scene.geometry.heads[1].cos_half_angle, 0.5, 1e-6);
  EXPECT_EQ(scene.geometry.heads[1].signal, 1);
  EXPECT_EQ(scene.scene.light_states, (std::vector{LightState::yellow, LightState::off, LightState::unknown}));
  EXPECT_EQ(scene.scene.light_begin, (std::vector<int32_t>{0, 3}));
}

std::vector<Strip> line(const std::string& keys) {
  return parse_scene(kView + "[[line]]\nwidth_m = 0.2\n" + keys, "s.toml").geometry.strips;
}

TEST(SceneFile, LinesByStyleAndColor) {
  const auto solid = line("kind = 'lane_mark'\npoints_m = [[0, 0], [25, 0]]\n");
  ASSERT_EQ(solid.size(), 3u);
  EXPECT_EQ(solid[0].color.b, kWhiteMarkColor.b);
  EXPECT_EQ(line("kind = 'lane_mark'\ncolor = 'yellow'\npoints_m = [[0, 0], [5, 0]]\n")[0].color.b, kYellowMarkColor.b);
  EXPECT_EQ(line("kind = 'stop_line'\npoints_m = [[0, 0], [5, 0]]\n")[0].color.g, kStopLineColor.g);

  // Dashes of 3 m with gaps of 2 m round a corner: 0-3, 5-8 over the corner at 6 m, 10-12.
  const auto broken =
      line("kind = 'road_edge'\nstyle = 'broken'\ndash_m = 3\ngap_m = 2\npoints_m = [[0, 0], [6, 0], [6, 6]]\n");
  ASSERT_EQ(broken.size(), 4u);
  EXPECT_NEAR(broken[0].b_m.x, 3, 1e-5);
  EXPECT_NEAR(broken[1].a_m.x, 5, 1e-5);
  EXPECT_NEAR(broken[2].b_m.y, 2, 1e-5);
  EXPECT_EQ(broken[1].side_b.x, broken[2].side_a.x);
  EXPECT_NEAR(broken[3].a_m.y, 4, 1e-5);
  EXPECT_NEAR(broken[3].b_m.y, 6, 1e-5);

  // A double line: both sides 0.15 m from the centre line, also round the corner.
  const auto both =
      line("kind = 'lane_mark'\nstyle = 'double'\nspacing_m = 0.3\npoints_m = [[0, 0], [6, 0], [6, 6]]\n");
  ASSERT_EQ(both.size(), 4u);
  EXPECT_NEAR(both[0].a_m.y, 0.15, 1e-6);
  EXPECT_NEAR(both[0].b_m.x, 5.85, 1e-6);
  EXPECT_NEAR(both[1].a_m.x, 5.85, 1e-6);
  EXPECT_NEAR(both[2].b_m.x, 6.15, 1e-6);
  EXPECT_NEAR(both[2].b_m.y, -0.15, 1e-6);

  EXPECT_EQ(line("kind = 'crosswalk'\nclosed = true\npoints_m = [[0, 0], [3, 0], [3, 3]]\n").size(), 3u);
}

TEST(SceneFile, WholeNumbersHaveAnyNotation) {
  const SceneFile scene = parse_scene("size_px = [4e1, 30.0]\n" + kAgent + kView + "hidden = [0.0]\n", "s.toml");
  EXPECT_EQ(scene.config.rig.cameras[0].width_px, 40);
  EXPECT_EQ(scene.config.rig.cameras[0].height_px, 30);
  EXPECT_EQ(scene.scene.hidden_agents, std::vector<int32_t>{0});
}

TEST(SceneFile, ErrorsNameTheLineOfBadFiles) {
  EXPECT_THAT(parse_error("[[view\n"), HasSubstr("s.toml:1: "));
  EXPECT_THAT(parse_error(""), HasSubstr("expected one or more [[view]] tables"));
  EXPECT_THAT(parse_error("sky = 1\n" + kView), HasSubstr("s.toml:1: unknown key 'sky'; known keys: camera, rig"));
  EXPECT_THAT(parse_error(kView + "heading_degs = 1\n"),
              HasSubstr("s.toml:5: view 0: unknown key 'heading_degs'; did you mean 'heading_deg'?; known keys: "));
  EXPECT_THAT(parse_error(kView + "speed_mps = 1\n"), HasSubstr("s.toml:5: view 0: unknown key 'speed_mps'"));
  EXPECT_THAT(parse_error("[[view]]\nx_m = 1.0\ny_m = 2.0\n"), HasSubstr("s.toml:1: view 0: heading_deg: is missing"));
  EXPECT_THAT(parse_error("[[view]]\nx_m = nan\n"), HasSubstr("s.toml:2: view 0: x_m: expected a number in"));
  EXPECT_THAT(parse_error("[[view]]\nx_m = inf\n"), HasSubstr("got inf"));
  EXPECT_THAT(parse_error("[[view]]\nx_m = '1'\n"), HasSubstr("expected a number"));
  EXPECT_THAT(parse_error("view = 3\n"), HasSubstr("view: expected a list, got 3"));
  EXPECT_THAT(parse_error("view = [3]\n"), HasSubstr("view: expected a table, got 3"));
  EXPECT_THAT(parse_error(kView + "ego = 0\n"), HasSubstr("view 0: ego: the scene has no agents"));
  EXPECT_THAT(parse_error(kAgent + kView + "ego = 1\n"),
              HasSubstr("s.toml:13: view 0: ego: expected an integer in [0, 0]"));
  EXPECT_THAT(parse_error(kAgent + kView + "hidden = [0, -1]\n"),
              HasSubstr("hidden: expected an integer in [0, 0], got -1"));
  EXPECT_THAT(parse_error(kAgent + kView + "hidden = [0.5]\n"), HasSubstr("expected an integer in [0, 0], got 0.5"));
  EXPECT_THAT(parse_error(kAgent + kView + "hidden = [nan]\n"), HasSubstr("expected an integer"));
  EXPECT_THAT(parse_error("size_px = [1e300, 8]\n" + kView), HasSubstr("expected an integer in [1, 8192], got 1.0"));
  EXPECT_THAT(parse_error(kView + "name = '../a'\n"), HasSubstr("got '../a'"));
  EXPECT_THAT(parse_error(kView + kView + "name = 'view0'\n"), HasSubstr("'view0' is already used"));
  EXPECT_THAT(parse_error(kView + "[[agent]]\nclass = 'tram'\n"),
              HasSubstr("s.toml:6: agent 0: class: expected one of vehicle, cyclist, pedestrian, got 'tram'"));
  EXPECT_THAT(parse_error(kView + kAgent + "drawn = 1\n"), HasSubstr("drawn: expected true or false, got 1"));
  const std::string wall = kView + "[[wall]]\nheight_m = 2\npoints_m = ";
  EXPECT_THAT(parse_error(wall + "[[0, 0]]\n"), HasSubstr("wall 0: points_m: expected 2 points or more, got 1"));
  EXPECT_THAT(parse_error(wall + "[[0, 0], [1]]\n"), HasSubstr("expected [x, y] or [x, y, z]"));
  EXPECT_THAT(parse_error(wall + "[[0, 0], [1e9, 1]]\n"), HasSubstr("expected a number in [-10000, 10000]"));
  EXPECT_THAT(parse_error(wall + "[[0, 0], [1, 1]]\ncolor_rgb = [1, 2]\n"), HasSubstr("color_rgb: expected 3 numbers"));
  EXPECT_THAT(parse_error(wall + "[[0, 0], [1, 1]]\ncolor_rgb = [1, 2, 256]\n"), HasSubstr("got 256"));
  const std::string mark = kView + "[[line]]\nkind = 'lane_mark'\nwidth_m = 0.1\npoints_m = [[0, 0], [9, 0]]\n";
  EXPECT_THAT(parse_error(mark + "dash_m = 1\n"), HasSubstr("dash_m: is for broken lines"));
  EXPECT_THAT(parse_error(mark + "spacing_m = 1\n"), HasSubstr("spacing_m: is for double lines"));
  EXPECT_THAT(parse_error(mark + "style = 'broken'\ndash_m = 1\n"), HasSubstr("gap_m: is missing"));
  EXPECT_THAT(parse_error(mark + "style = 'broken'\ndash_m = 0.0\ngap_m = 0.0\n"), HasSubstr("dash_m: expected"));
  EXPECT_THAT(parse_error(mark + "color = 'white'\ncolor_rgb = [1, 2, 3]\n"), HasSubstr("color: is for"));
  EXPECT_THAT(parse_error("rig = 'a.toml'\n[[camera]]\nwidth_px = 8\nheight_px = 8\nfocal_px = 9\n" + kView),
              HasSubstr("rig: has no effect with [[camera]]"));
  EXPECT_THAT(parse_error("rig = 'no/such.toml'\n" + kView), HasSubstr("no/such.toml: no such file"));
  EXPECT_THAT(parse_error("size_px = [0, 8]\n" + kView), HasSubstr("size_px: expected an integer in [1, 8192], got 0"));
  EXPECT_THAT(parse_error("[[camera]]\nwidth_px = 8\nheight_px = 8\nfocal_px = 9\nzoom = 2\n" + kView),
              HasSubstr("s.toml:5: camera 0 'camera0': unknown key 'zoom'"));
  // A line of millions of pieces is rejected before it is divided.
  std::string zigzag = kView + "[[line]]\nkind = 'lane_mark'\nwidth_m = 0.1\npoints_m = [";
  for (int i = 0; i < 50; ++i) zigzag += "[-9000, 0], [9000, 0], ";
  EXPECT_THAT(parse_error(zigzag + "]\n"), HasSubstr("points_m: expected at most 100000 m of line"));
}

TEST(SceneFile, ObjectsThatDrawNothingAreRefused) {
  EXPECT_THAT(parse_error("camera = []\n" + kView),
              HasSubstr("s.toml:1: camera: expected one or more [[camera]] tables"));
  EXPECT_THAT(parse_error(kAgent + kView + "hidden = [0, 0]\n"), HasSubstr("hidden: agent 0 is listed twice"));
  EXPECT_THAT(parse_error(kView + "[[agent]]\nclass = 'vehicle'\nx_m = 1\ny_m = 1\nlength_m = 0\n"),
              HasSubstr("length_m: expected a number in [0.001, 1000], got 0"));
  const std::string wall = kView + "[[wall]]\npoints_m = [[0, 0], [1, 0], [1, 0, 2]]\nheight_m = ";
  EXPECT_THAT(parse_error(wall + "0\n"), HasSubstr("height_m: expected a number in [0.001, 1000], got 0"));
  EXPECT_THAT(parse_error(wall + "2\n"), HasSubstr("points_m: points 1 and 2 are at the same place"));
  const std::string line = kView + "[[line]]\nkind = 'lane_mark'\npoints_m = [[1, 1], [1, 1]]\nwidth_m = ";
  EXPECT_THAT(parse_error(line + "0\n"), HasSubstr("width_m: expected a number"));
  EXPECT_THAT(parse_error(line + "0.1\n"), HasSubstr("points_m: expected points at different places"));
  EXPECT_THAT(parse_error(kView + "[[light]]\nx_m = 1\ny_m = 1\nfacing_deg = 0\nhalf_angle_deg = 0\n"),
              HasSubstr("half_angle_deg: expected a number in [0.1, 180], got 0"));
}

TEST(SceneFile, MessagesAreOneLineAndListKnownKeys) {
  const std::string one_table = parse_error("[view]\nx_m = 1.0\ny_m = 2.0\nheading_deg = 3.0\n");
  EXPECT_THAT(one_table, HasSubstr("s.toml:1: view: expected [[view]] tables, got a table [view]"));
  EXPECT_THAT(parse_error(kView + "x = 1\n"), HasSubstr("heading_deg, ego, body_length_m, hidden"));
  const std::string table = parse_error("line_floor_px = {a = 1, b = 2}\n" + kView);
  EXPECT_THAT(table, HasSubstr("line_floor_px: expected a number in [0, 8], got a table"));
  EXPECT_THAT(parse_error("size_px = [8, 4]\n[[camera]]\nwidth_px = 8\nheight_px = 8\nfocal_px = 9\n" + kView),
              HasSubstr("s.toml:1: size_px: is only for the paper's cameras"));
  EXPECT_THAT(parse_error("sky = 1\n" + kView),
              HasSubstr("known keys: camera, rig, size_px, square_pixels, line_floor_px"));
  EXPECT_THAT(parse_error("rig = 'no/such.toml'\n" + kView), HasSubstr("s.toml: rig: "));
}

TEST(SceneFile, PixelsOfThePapersCamerasCanBeSquareAtAnySize) {
  const Camera stretched = parse_scene("size_px = [64, 64]\n" + kView, "s").config.rig.cameras[0],
               square = parse_scene("size_px = [64, 64]\nsquare_pixels = true\n" + kView, "s").config.rig.cameras[0];
  EXPECT_EQ(square.focal_x_px, stretched.focal_x_px);
  EXPECT_EQ(square.focal_y_px, square.focal_x_px);
  EXPECT_GT(stretched.focal_y_px, 1.7f * stretched.focal_x_px);
}

TEST(SceneFile, APipeIsRefusedWithoutWaiting) {
  const test::ScratchFolder folder;
  const std::string pipe = folder / "pipe.toml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(test::message_of([&] { load_scene(pipe); }), HasSubstr("pipe.toml: expected a regular file, got a pipe"));
  EXPECT_THAT(test::message_of([&] { load_rig(pipe); }), HasSubstr("pipe.toml: expected a regular file, got a pipe"));
}

TEST(SceneFile, ARigFileIsFoundInTheScenesFolder) {
  const test::ScratchFolder folder;
  std::filesystem::create_directory(folder / "rigs");
  write_file(folder / "rigs/one.toml", "[[camera]]\nname = 'one'\nwidth_px = 8\nheight_px = 4\nfocal_px = 9\n");
  write_file(folder / "scene.toml", "rig = 'rigs/one.toml'\n" + kView);
  EXPECT_EQ(load_scene(folder / "scene.toml").config.rig.cameras[0].name, "one");
  EXPECT_THROW(load_scene(folder / "none.toml"), Error);
}

}  // namespace
}  // namespace pictura
