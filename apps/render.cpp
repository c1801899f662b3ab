// `pictura render`: writes what cameras see, of a scene file or of a world that was driven with random actions.
#include <cctype>
#include <chrono>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/apps/commands.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/cli/drive.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/scene_file.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/planes.h"

namespace pictura {

namespace {

struct Arguments {
  WorldOptions world;
  int steps = 50, views = 4;
  BackendOptions backends;
  std::string size = "96x54", rig, out;
  std::vector<std::string> planes;
  float line_floor_px = RendererConfig{}.line_floor_px;
  bool size_given = false, square_pixels = false, figure = false, json = false;
};

/// What is drawn, and under which names, whether a world was driven there or a file says so.
struct Subject {
  std::vector<StaticGeometry> geometries;
  SceneBatch scene;
  Span<const View> views;
  std::vector<std::string> names, captions;  // [views]
};

bool is_scene_file(const std::string& map) {
  std::string extension = std::filesystem::path(map).extension().string();
  for (char& letter : extension) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return extension == ".toml";
}

std::unique_ptr<Renderer> open_renderer(const Arguments& arguments, RendererConfig config) {
  config.num_threads = arguments.world.num_threads;
  if (!arguments.backends.samples.empty()) config.samples = parse_samples("--samples", arguments.backends.samples);
  const std::string name = arguments.backends.renderer.empty() ? "auto" : arguments.backends.renderer;
  std::string choice;
  auto renderer = make_renderer(name, config, &choice);
  PICTURA_CHECK(renderer->device().is_host(), "--renderer {}: pictures are written from host memory; choose cpu",
                renderer->name());
  if (name == "auto") fmt::print(stderr, "backend {}\n", choice);
  make_output_folder(arguments.out);
  return renderer;
}

/// Draws the subject. Returns views per second: the median of five calls after one that warms up.
double draw(const Subject& subject, Renderer* renderer, HostImages* images_out) {
  const InterruptibleWork work("interrupted while images were drawn");
  upload_geometries(subject.geometries, renderer);
  renderer->render(subject.scene, subject.views, images_out->batch());
  std::vector<double> seconds;
  for (int repeat = 0; repeat < 5; ++repeat) {
    work.check();
    const auto begin = std::chrono::steady_clock::now();
    renderer->render(subject.scene, subject.views, images_out->batch());
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + 2, seconds.end());
  return static_cast<double>(subject.views.size()) / seconds[2];
}

/// Returns the paths of the contact sheets.
std::vector<std::string> write_pictures(const Arguments& arguments, const Subject& subject, const Rig& rig,
                                        const HostImages& images) {
  const InterruptibleWork work("interrupted while pictures were written");
  const int num_views = static_cast<int>(subject.views.size());
  for (int view = 0; view < num_views; ++view) {
    work.check();
    for (int camera = 0; camera < static_cast<int>(rig.cameras.size()); ++camera) {
      const CameraImages& image = images.camera(camera);
      const std::string stem = fmt::format("{}/{}_{}", arguments.out, subject.names[static_cast<size_t>(view)],
                                           rig.cameras[static_cast<size_t>(camera)].name);
      write_png(stem + ".png", image.width_px, image.height_px, images.interleaved(view, camera));
      for (const std::string& plane : arguments.planes) {
        const RgbImage picture = plane_picture(images, view, camera, plane_by_name(plane));
        write_png(fmt::format("{}_{}.png", stem, plane), picture.width_px, picture.height_px, picture.rgb);
      }
    }
  }
  const std::vector<std::string> sheets =
      draw_contact_sheets(images, rig, subject.names, arguments.out + "/contact_sheet");
  if (!arguments.figure) return sheets;
  std::vector<RgbImage> panels;
  for (int view = 0; view < num_views; ++view) {
    work.check();
    panels.push_back(captioned(images, view, 0, subject.captions[static_cast<size_t>(view)]));
    const RgbImage& panel = panels.back();
    write_png(fmt::format("{}/{}.png", arguments.out, subject.names[static_cast<size_t>(view)]), panel.width_px,
              panel.height_px, panel.rgb);
  }
  const RgbImage all = assembled(panels);
  write_png(arguments.out + "/figure.png", all.width_px, all.height_px, all.rgb);
  return sheets;
}

void draw_and_report(const Arguments& arguments, const Subject& subject, Renderer* renderer) {
  const Rig& rig = renderer->config().rig;
  const int num_views = static_cast<int>(subject.views.size()), num_cameras = static_cast<int>(rig.cameras.size());
  HostImages images(rig, num_views, PixelFormat::u8, arguments.planes.empty() ? Planes::none : Planes::all);
  const double rate = draw(subject, renderer, &images);
  const std::vector<std::string> sheets = write_pictures(arguments, subject, rig, images);

  Hash64 hash;
  hash.add(Span<const uint8_t>(images.bytes()));
  if (arguments.json) {
    print_json({{"backend", renderer->name()},
                {"images", num_views * num_cameras},
                {"cameras", num_cameras},
                {"agent_steps_per_s", rate},
                {"image_hash", hash.hex()},
                {"out", arguments.out},
                {"contact_sheet", sheets[0]},
                {"contact_sheets", sheets}});
  } else {
    fmt::print("{} images in {}, contact sheet {}; {} agent-steps/s drawn by {}; image hash {}\n",
               num_views * num_cameras, arguments.out, fmt::join(sheets, ", "), format_count(rate), renderer->name(),
               hash.hex());
  }
}

void render_scene_file(const Arguments& arguments) {
  const SceneFile file = load_scene(arguments.world.map);
  const auto renderer = open_renderer(arguments, file.config);
  draw_and_report(arguments, {{file.geometry}, file.scene.batch(), file.views, file.view_names, file.view_captions},
                  renderer.get());
}

void render_world(const Arguments& arguments) {
  const Pair size = parse_pair("--size", arguments.size, 8192);
  if (!arguments.rig.empty() && arguments.size_given) fail_usage("--size: the rig of --rig has sizes of its own");
  if (!arguments.rig.empty() && arguments.square_pixels) fail_usage("--square-pixels: has no effect beside --rig");
  if (arguments.views > arguments.world.agents) {
    fail_usage("--views: expected 1 to {} (one per agent), got {}", arguments.world.agents, arguments.views);
  }
  RendererConfig config;
  config.rig =
      arguments.rig.empty() ? paper_rig(size.first, size.second, arguments.square_pixels) : load_rig(arguments.rig);
  config.line_floor_px = arguments.line_floor_px;
  const auto renderer = open_renderer(arguments, config);

  DrivenWorld world = make_world(arguments.world, "random", arguments.backends);
  Simulator* const simulator = world.simulator.get();
  for (int step = 0; step < arguments.steps; ++step) {
    if (interrupted()) throw Interrupted(fmt::format("interrupted at step {} of {}", step, arguments.steps));
    world.act();
    world.step();
  }

  Subject subject{{simulator->maps()[0]->geometry},
                  simulator->scene(),
                  simulator->views().subspan(0, static_cast<size_t>(arguments.views)),
                  {},
                  {}};
  for (int view = 0; view < arguments.views; ++view) subject.names.push_back(fmt::format("agent{:03}", view));
  subject.captions = subject.names;
  draw_and_report(arguments, subject, renderer.get());
}

// A scene file says these itself.
void refuse_world_options(const CLI::App& command) {
  for (const char* option : {"--agents", "--pedestrians", "--cyclists", "--parked", "--seed", "--no-walls", "--steps",
                             "--views", "--size", "--square-pixels", "--rig", "--line-floor", "--simulator"}) {
    if (command.count(option) > 0) fail_usage("{}: has no effect on a scene file, which says that itself", option);
  }
}

}  // namespace

void add_render_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "Write what the cameras of some agents see");
  command
      ->add_option("MAP", arguments->world.map,
                   "A .xodr file, a town's name, procedural[:SEED], or a scene file (.toml)")
      ->required();
  add_world_options(command, &arguments->world);
  command->add_option("--steps", arguments->steps, "Steps of random actions before the pictures")
      ->transform(whole_number(0))
      ->capture_default_str();
  command->add_option("--views", arguments->views, "Draw the cameras of the first so many agents")
      ->transform(whole_number(1))
      ->capture_default_str();
  CLI::Option* size =
      command->add_option("--size", arguments->size, "Image size in pixels, WxH")->capture_default_str();
  command->add_flag("--square-pixels", arguments->square_pixels,
                    "At sizes that are not 16:9, keep pixels square and the horizontal field of view");
  add_backend_options(command, "auto", &arguments->backends);
  command->add_option("--rig", arguments->rig, "TOML file with [[camera]] tables instead of the paper's four cameras");
  command
      ->add_option("--line-floor", arguments->line_floor_px,
                   "Least width of a line on screen in pixels; 0 turns it off")
      ->transform(number(0, kGuardBand_px))
      ->capture_default_str();
  command->add_option("--planes", arguments->planes, "Also write these planes as pictures: depth, class, instance")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(one_of({"depth", "class", "instance"}));
  command->add_flag("--figure", arguments->figure,
                    "Also write VIEW.png, its first camera enlarged with a caption, and figure.png with all of them");
  command->add_option("--out", arguments->out, "Folder for the pictures")->required();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura render Town01 --agents 80 --steps 100 --views 6 --size 192x108 --out images\n"
      "  pictura render procedural:1 --agents 40 --steps 20 --views 2 --out images\n"
      "  pictura render tests/golden/crossing.toml --backend cpu --planes depth,class --out images");
  command->callback([arguments, size, command] {
    if (is_scene_file(arguments->world.map)) {
      refuse_world_options(*command);
      return render_scene_file(*arguments);
    }
    arguments->size_given = size->count() > 0;
    arguments->world.vector_observations = false;
    render_world(*arguments);
  });
}

}  // namespace pictura
