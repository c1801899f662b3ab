// `pictura render`: drives a world with random actions, then writes what its agents' cameras see.
#include <chrono>

#include "pictura/apps/commands.h"
#include "pictura/apps/drawing.h"
#include "pictura/apps/drive.h"
#include "pictura/apps/report.h"
#include "pictura/common/error.h"
#include "pictura/common/file.h"
#include "pictura/common/hash.h"
#include "pictura/common/interrupt.h"
#include "pictura/common/make_renderer.h"

namespace pictura {

namespace {

struct Arguments {
  WorldOptions world;
  int steps = 50, views = 4;
  std::string size = "96x54", backend = "auto", samples = "1", rig, out;
  float line_floor_px = RendererConfig{}.line_floor_px;
  bool size_given = false, json = false;
};

void run(const Arguments& arguments) {
  const Pair size = parse_pair("--size", arguments.size, 8192);
  if (!arguments.rig.empty() && arguments.size_given) fail_usage("--size: the rig of --rig has sizes of its own");
  if (arguments.views > arguments.world.agents) {
    fail_usage("--views: expected 1 to {} (one per agent), got {}", arguments.world.agents, arguments.views);
  }
  RendererConfig config;
  config.rig = arguments.rig.empty() ? paper_rig(size.first, size.second) : load_rig(arguments.rig);
  config.num_threads = arguments.world.num_threads;
  config.line_floor_px = arguments.line_floor_px;
  config.samples = parse_samples("--samples", arguments.samples);
  std::string choice;
  const auto renderer = make_renderer(arguments.backend, config, &choice);
  PICTURA_CHECK(renderer->space() == MemorySpace::host,
                "--backend {}: pictures are written from host memory; choose cpu", renderer->name());
  if (arguments.backend == "auto") fmt::print(stderr, "backend {}\n", choice);
  make_output_folder(arguments.out);

  const auto pilot = make_pilot("random", arguments.world.seed, arguments.backend, arguments.world.num_threads);
  const auto simulator = make_world(arguments.world, pilot.get());
  std::vector<int32_t> actions(static_cast<size_t>(simulator->num_slots()));
  for (int step = 0; step < arguments.steps; ++step) {
    if (interrupted()) throw Interrupted(fmt::format("interrupted at step {} of {}", step, arguments.steps));
    pilot->act(*simulator, actions);
    simulator->step(actions);
  }

  upload_geometries(*simulator, renderer.get());
  const int num_views = arguments.views;
  HostImages images(config.rig, num_views);
  const Span<const View> views = simulator->views().subspan(0, static_cast<size_t>(num_views));
  renderer->render(simulator->scene(), views, images.batch());  // warm-up
  std::vector<double> seconds;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto begin = std::chrono::steady_clock::now();
    renderer->render(simulator->scene(), views, images.batch());
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + 2, seconds.end());

  const int num_cameras = static_cast<int>(config.rig.cameras.size());
  for (int view = 0; view < num_views; ++view) {
    for (int camera = 0; camera < num_cameras; ++camera) {
      const CameraImages& image = images.camera(camera);
      write_png(fmt::format("{}/agent{:03}_{}.png", arguments.out, view,
                            config.rig.cameras[static_cast<size_t>(camera)].name),
                image.width_px, image.height_px, images.interleaved(view, camera));
    }
  }
  const std::string sheet = arguments.out + "/contact_sheet.png";
  draw_contact_sheet(images, config.rig, num_views, sheet);

  Hash64 hash;
  hash.add(Span<const uint8_t>(images.bytes()));
  const double rate = num_views / seconds[2];
  if (arguments.json) {
    print_json({{"backend", renderer->name()},
                {"images", num_views * num_cameras},
                {"cameras", num_cameras},
                {"agent_steps_per_s", rate},
                {"image_hash", hash.hex()},
                {"out", arguments.out},
                {"contact_sheet", sheet}});
  } else {
    fmt::print("{} images in {}, contact sheet {}; {} agent-steps/s drawn by {}; image hash {}\n",
               num_views * num_cameras, arguments.out, sheet, format_count(rate), renderer->name(), hash.hex());
  }
}

}  // namespace

void add_render_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "Write what the cameras of some agents see");
  command->add_option("MAP", arguments->world.map, "A .xodr file, a town's name, or procedural[:SEED]")->required();
  add_world_options(command, &arguments->world);
  command->add_option("--steps", arguments->steps, "Steps of random actions before the pictures")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--views", arguments->views, "Draw the cameras of the first so many agents")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI::Option* size =
      command->add_option("--size", arguments->size, "Image size in pixels, WxH")->capture_default_str();
  command->add_option("--backend", arguments->backend, "cpu, cuda, gl, gl:egl, gl:osmesa, null or auto")
      ->capture_default_str();
  command
      ->add_option("--samples", arguments->samples,
                   "Of a pixel, for gl: 1, N (MSAA) or NxN (supersampling); the others compute exact coverage")
      ->capture_default_str();
  command->add_option("--rig", arguments->rig, "TOML file with [[camera]] tables instead of the paper's four cameras");
  command
      ->add_option("--line-floor", arguments->line_floor_px,
                   "Least width of a line on screen in pixels; 0 turns it off")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--out", arguments->out, "Folder for the pictures")->required();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer("Example:\n  pictura render Town01 --agents 80 --steps 100 --views 6 --size 192x108 --out images");
  command->callback([arguments, size] {
    arguments->size_given = size->count() > 0;
    arguments->world.vector_observations = false;
    run(*arguments);
  });
}

}  // namespace pictura
