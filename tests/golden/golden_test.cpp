// Golden images. Each scene of this folder is drawn by a backend and compared with its PNG, which the oracle (the CPU
// renderer) has drawn. The oracle is also compared with the truth (the ray caster).
//   golden_test [--backend NAME] [--out DIR] [GoogleTest's options]
//   golden_test --update     redraws the pictures with the oracle
// A failure writes enlarged pictures to DIR/SCENE_{expected,actual,difference}.png. The difference has eightfold
// contrast.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/golden/golden_picture.h"
#include "pictura/tests/golden/golden_scenes.h"

namespace pictura {
namespace {

struct Options {
  std::string backend = "cpu", out = "golden_failures";
  bool update = false;
} options;

std::unique_ptr<Renderer> oracle_for(const SceneFile& scene) {
  RendererConfig config = scene.config;
  config.num_threads = 1;
  return make_renderer("cpu", config);
}

bool is_gl(const std::string& backend) { return backend.starts_with("gl"); }

const ImageTolerance& truth_tolerance_of(const std::string& scene) {
  return scene == "one_pixel" ? kGoldenTruthOnePixel : kGoldenTruth;
}

const ImageTolerance& gl_tolerance_of(const std::string& scene) {
  return scene == "one_pixel" ? kGoldenGlOnePixel : kGoldenGl;
}

const ImageTolerance& tolerance_of(const std::string& backend, const std::string& scene) {
  if (backend == "cpu") return kGoldenOracle;
  if (backend == "cuda") return kGoldenKernel;
  if (is_gl(backend)) return gl_tolerance_of(scene);
  fail_usage("--backend {}: no tolerance for it in bench/truth/tolerances.h", backend);
}

/// Returns a renderer for the scene with the backend of the command line, or null and the reason. Null is a failure if
/// PICTURA_REQUIRE_GPU=1 or PICTURA_REQUIRE_GL requires the backend.
std::unique_ptr<Renderer> backend_for(const SceneFile& scene, std::string* why_not_out) {
  RendererConfig config = scene.config;
  config.num_threads = 1;
  if (is_gl(options.backend)) config.samples.grid = kGoldenGlGrid;
  try {
    return make_renderer(options.backend, config);
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    *why_not_out = error.what();
  }
  const char* variable = is_gl(options.backend) ? "PICTURA_REQUIRE_GL" : "PICTURA_REQUIRE_GPU";
  const char* value = std::getenv(variable);
  const std::string required = value ? value : "";
  if (required.find(is_gl(options.backend) ? options.backend : "1") != std::string::npos) {
    ADD_FAILURE() << variable << "=" << required << ", but " << *why_not_out;
  }
  return nullptr;
}

void write_failure(const std::string& name, const SceneFile& scene, const Drawing& expected, const Drawing& actual) {
  make_output_folder(options.out);
  for (const auto& [what, drawing] : {std::pair{"expected", expected}, std::pair{"actual", actual},
                                      std::pair{"difference", difference(expected, actual)}}) {
    const RgbImage picture = enlarged(to_picture(scene, drawing));
    write_png(fmt::format("{}/{}_{}.png", options.out, name, what), picture.width_px, picture.height_px, picture.rgb);
  }
}

void expect_within(const std::string& name, const SceneFile& scene, const Drawing& actual, const Drawing& expected,
                   const ImageTolerance& tolerance) {
  const std::string why = complaint(error_of(actual, expected), tolerance);
  if (why.empty()) return;
  write_failure(name, scene, expected, actual);
  ADD_FAILURE() << name << ": " << why << "; see " << options.out << "/" << name << "_*.png";
}

class Golden : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(golden_names(".toml")),
                         [](const auto& scene) { return scene.param; });

TEST_P(Golden, LooksLikeItsPicture) {
  const SceneFile scene = load_scene(scene_path(GetParam()));
  std::string why_not;
  const auto renderer = backend_for(scene, &why_not);
  if (!renderer) GTEST_SKIP() << why_not;
  const Drawing actual = draw_scene(renderer.get(), scene, PixelFormat::u8);
  if (options.update) {
    const RgbImage picture = to_picture(scene, actual);
    write_png(picture_path(GetParam()), picture.width_px, picture.height_px, picture.rgb);
    return;
  }
  const Drawing expected = from_picture(scene, read_png(picture_path(GetParam())));
  const PooledError error = error_of(actual, expected);
  fmt::print("{}: {:.2f} dB, worst {:.2f}/255\n", GetParam(), error.psnr_db(), 255 * error.max_error());
  expect_within(GetParam(), scene, actual, expected, tolerance_of(options.backend, GetParam()));
}

TEST_P(Golden, LooksLikeTheTruth) {
  if (GetParam() == "debug_palette") GTEST_SKIP() << "the truth has no debug palette";
  const SceneFile scene = load_scene(scene_path(GetParam()));
  const Drawing actual = draw_scene(oracle_for(scene).get(), scene, PixelFormat::f32), truth = trace_scene(scene);
  const PooledError error = error_of(actual, truth);
  fmt::print("{}: {:.2f} dB, worst {:.2f}/255\n", GetParam(), error.psnr_db(), 255 * error.max_error());
  expect_within(GetParam() + "_truth", scene, actual, truth, truth_tolerance_of(GetParam()));
}

TEST(GoldenFolder, EveryPictureHasItsScene) { EXPECT_EQ(golden_names(".png"), golden_names(".toml")); }

// Possible faults of a renderer, seeded in the scene that the oracle draws. Each fault must exceed every tolerance
// against the correct picture; a tolerance that accepts a fault is too wide.
struct Fault {
  const char *what, *scene;
  std::function<void(SceneFile*)> seed;
};

const std::vector<Fault>& faults() {
  static const std::vector<Fault> all{
      {"a box 10 cm to the side", "vehicles", [](SceneFile* s) { s->scene.agents[0].center_m.y += 0.1f; }},
      {"front and back swapped", "vehicles",
       [](SceneFile* s) {
         s->scene.agents[0].cos_heading *= -1;
         s->scene.agents[0].sin_heading *= -1;
       }},
      {"a cyclist in the colours of a vehicle", "cyclists",
       [](SceneFile* s) { s->scene.agents[3].agent_class = AgentClass::vehicle; }},
      {"a pedestrian missing", "pedestrians", [](SceneFile* s) { s->scene.agents[4].drawn = 0; }},
      {"halted cars paled", "halted_and_parked", [](SceneFile* s) { s->config.debug_palette = true; }},
      {"a wall 20 cm too low", "walls", [](SceneFile* s) { s->geometry.walls[3].height_m -= 0.2f; }},
      {"a wall missing", "wall_through_the_image", [](SceneFile* s) { s->geometry.walls.clear(); }},
      {"white for yellow", "lane_marks", [](SceneFile* s) { s->geometry.strips[1].color = kWhiteMarkColor; }},
      {"marks twice as wide", "lane_marks",
       [](SceneFile* s) {
         for (Strip& strip : s->geometry.strips) strip.width_m *= 2;
       }},
      {"strips of one level in the wrong order", "road_lines",
       [](SceneFile* s) { s->geometry.strips.back().kind = StripKind::road_edge; }},
      {"green for red", "lights", [](SceneFile* s) { s->scene.light_states[1] = LightState::green; }},
      {"a light seen from behind", "light_from_behind", [](SceneFile* s) { s->geometry.heads[0].facing = {-1, 0}; }},
      {"a light that is off not drawn", "lights", [](SceneFile* s) { s->scene.light_states[4] = LightState::unknown; }},
      {"an unknown light drawn", "lights", [](SceneFile* s) { s->scene.light_states[5] = LightState::off; }},
      {"half-angles ignored", "lights", [](SceneFile* s) { s->geometry.heads[3].cos_half_angle = -1; }},
      {"no floor", "taper", [](SceneFile* s) { s->config.line_floor_px = 0; }},
      {"a floor where there is none", "taper_without_floor", [](SceneFile* s) { s->config.line_floor_px = 0.35f; }},
      {"faces across the near plane dropped", "near_plane", [](SceneFile* s) { s->scene.agents[0].drawn = 0; }},
      {"a car on the bridge 30 cm too low", "bridge", [](SceneFile* s) { s->scene.agents[2].center_m.z -= 0.3f; }},
      {"a colliding box 20 cm farther", "overlapping_boxes",
       [](SceneFile* s) { s->scene.agents[1].center_m.x += 0.2f; }},
      {"the slope ignored", "ramp", [](SceneFile* s) { s->scene.agents[0].center_m.z = 0; }},
      {"hidden agents drawn", "left_out", [](SceneFile* s) { s->views[1].hidden_end = s->views[1].hidden_begin; }},
      {"the ego drawn", "left_out", [](SceneFile* s) { s->views[2].ego_agent = -1; }},
      {"cameras of short bodies not moved in", "short_bodies", [](SceneFile* s) { s->views[1].body_length_m = 4.5f; }},
      {"half a degree of roll", "eight_cameras",
       [](SceneFile* s) { s->config.rig.cameras[4].roll_rad += radians_of(0.5); }},
      {"a principal point half a pixel off", "eight_cameras",
       [](SceneFile* s) { s->config.rig.cameras[5].center_x_px += 0.5f; }},
      {"pixel centres half a pixel off", "odd_size",
       [](SceneFile* s) {
         for (Camera& camera : s->config.rig.cameras) camera.center_y_px += 0.5f;
       }},
      {"two cameras swapped", "one_pixel",
       [](SceneFile* s) { std::swap(s->config.rig.cameras[0], s->config.rig.cameras[3]); }},
      {"no fading", "fading", [](SceneFile* s) { s->scene.agents[2].center_m.x -= 12; }},
  };
  return all;
}

class SeededFault : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(All, SeededFault, testing::Range(std::size_t{0}, faults().size()), [](const auto& fault) {
  std::string name = faults()[fault.param].what;
  std::replace_if(name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
});

TEST_P(SeededFault, ExceedsEveryTolerance) {
  const Fault& fault = faults()[GetParam()];
  SceneFile scene = load_scene(scene_path(fault.scene));
  const Drawing correct = draw_scene(oracle_for(scene).get(), scene, PixelFormat::f32);
  fault.seed(&scene);
  scene.geometry.build_grids();
  const Drawing faulty = draw_scene(oracle_for(scene).get(), scene, PixelFormat::f32);
  const PooledError error = error_of(faulty, correct);
  fmt::print("{:.2f} dB, worst {:.1f}/255\n", error.psnr_db(), 255 * error.max_error());
  for (const ImageTolerance& tolerance :
       {kGoldenOracle, kGoldenKernel, truth_tolerance_of(fault.scene), gl_tolerance_of(fault.scene)}) {
    EXPECT_NE(complaint(error, tolerance), "") << tolerance.name;
  }
}

TEST(GoldenTolerances, EachPartFails) {
  // One image of 100,000 values, some with an error.
  auto complaint_of = [](int values, double off, const ImageTolerance& tolerance) {
    const Drawing expected{std::vector<float>(100000, 0.5f)};
    Drawing actual = expected;
    for (int i = 0; i < values; ++i) actual[0][i] += static_cast<float>(off);
    return complaint(error_of(actual, expected), tolerance);
  };
  using testing::HasSubstr;
  EXPECT_EQ(complaint_of(0, 0, kGoldenOracle), "");
  EXPECT_THAT(complaint_of(1, 1.0 / 255, kGoldenOracle), HasSubstr("worst"));
  EXPECT_EQ(complaint_of(9, 3.9 / 255, kGoldenKernel), "");
  EXPECT_THAT(complaint_of(1, 4.1 / 255, kGoldenKernel), HasSubstr("worst"));
  EXPECT_THAT(complaint_of(11, 2.0 / 255, kGoldenKernel), HasSubstr("%"));
  EXPECT_EQ(complaint_of(100000, 0.4 / 255, kGoldenTruth), "");
  EXPECT_THAT(complaint_of(100000, 0.5 / 255, kGoldenTruth), HasSubstr("dB"));
  // NaN exceeds every tolerance.
  for (const ImageTolerance& tolerance : {kGoldenOracle, kGoldenKernel, kGoldenTruth, kGoldenGl}) {
    EXPECT_THAT(complaint_of(1, std::nan(""), tolerance), HasSubstr("worst")) << tolerance.name;
  }
}

}  // namespace

int run(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--update") {
      options.update = true;
    } else if ((option == "--backend" || option == "--out") && i + 1 < argc) {
      (option == "--out" ? options.out : options.backend) = argv[++i];
    } else {
      fmt::print(stderr, "error: unknown option {}; see the top of golden_test.cpp\n", option);
      return 2;
    }
  }
  if (options.update) {
    options.backend = "cpu";
    testing::GTEST_FLAG(filter) = "*LooksLikeItsPicture*";
  }
  return RUN_ALL_TESTS();
}

}  // namespace pictura

int main(int argc, char** argv) { return pictura::run(argc, argv); }
