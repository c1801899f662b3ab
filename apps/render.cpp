// `pictura render`: writes camera images of a scene file, of a world that random actions drive, or of a recorded scene.
#include <cctype>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/apps/commands.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/scene_file.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/planes.h"
#include "pictura/driving/world.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/simulator/drive_steps.h"
#include "pictura/simulator/recorded_scene.h"

namespace pictura {

namespace {

struct RenderArguments {
  WorldOptions world;
  int steps = 50, views = 4;
  std::string tracks;  // tracks of a recorded scene whose cameras are drawn
  std::string size = "96x54", rig, out;
  std::vector<std::string> planes;
  float line_floor_px = RendererConfig{}.line_floor_px;
  bool size_given = false, square_pixels = false, figure = false, json = false;
};

/// A scene to draw, from a simulated world or a file, with names for image files.
struct Subject {
  std::vector<StaticGeometry> geometries;  // the handle of a geometry is its index
  SceneBatch scene;
  Span<const View> views;
  std::vector<std::string> names, captions;  // [views]
};

bool is_scene_file(const std::string& map) {
  std::string extension = std::filesystem::path(map).extension().string();
  for (char& letter : extension) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return extension == ".toml";
}

std::unique_ptr<Renderer> open_renderer(const RenderArguments& arguments, RendererConfig config) {
  const WorldOptions& world = arguments.world;
  config.num_threads = world.num_threads;
  if (!world.samples.empty()) config.samples = parse_samples("--samples", world.samples);
  const std::string name = world.renderer.empty() ? "auto" : world.renderer;
  std::string choice;
  auto renderer = make_renderer(name, config, &choice);
  PICTURA_CHECK(renderer->device().is_host(), "--renderer {}: pictures are written from host memory; use cpu",
                renderer->name());
  if (name == "auto") print_message("backend {}\n", choice);
  return renderer;
}

/// Draws the subject. Returns views per second: the median of five calls after a warm-up call.
double draw(const Subject& subject, Renderer* renderer, HostImages* images_out) {
  upload_geometries(subject.geometries, renderer);
  renderer->render(subject.scene, subject.views, images_out->batch());
  std::vector<double> seconds;
  for (int repeat = 0; repeat < 5; ++repeat) {
    if (interrupted()) throw Interrupted("interrupted while images were drawn");
    const Stopwatch watch;
    renderer->render(subject.scene, subject.views, images_out->batch());
    seconds.push_back(watch.seconds());
  }
  std::nth_element(seconds.begin(), seconds.begin() + 2, seconds.end());
  return static_cast<double>(subject.views.size()) / seconds[2];
}

/// Writes the pictures. Returns the paths of the contact sheets, which are overviews of all views.
std::vector<std::string> write_pictures(const RenderArguments& arguments, const Subject& subject, const Rig& rig,
                                        const HostImages& images, FilledFolder* out) {
  const auto check = [] {
    if (interrupted()) throw Interrupted("interrupted while pictures were written");
  };
  const int num_views = static_cast<int>(subject.views.size());
  for (int view = 0; view < num_views; ++view) {
    check();
    for (int camera = 0; camera < static_cast<int>(rig.cameras.size()); ++camera) {
      const CameraImages& image = images.camera(camera);
      const std::string stem = fmt::format("{}_{}", subject.names[view], rig.cameras[camera].name);
      write_png(out->file(stem + ".png"), image.width_px, image.height_px, images.interleaved(view, camera));
      for (const std::string& plane : arguments.planes) {
        const RgbImage picture = plane_picture(images, view, camera, plane_by_name(plane));
        write_png(out->file(fmt::format("{}_{}.png", stem, plane)), picture.width_px, picture.height_px, picture.rgb);
      }
    }
  }
  const std::vector<std::string> sheets = draw_contact_sheets(images, rig, subject.names, out);
  if (!arguments.figure) return sheets;
  std::vector<RgbImage> panels;
  for (int view = 0; view < num_views; ++view) {
    check();
    panels.push_back(captioned(images, view, 0, subject.captions[static_cast<size_t>(view)]));
    const RgbImage& panel = panels.back();
    write_png(out->file(subject.names[view] + ".png"), panel.width_px, panel.height_px, panel.rgb);
  }
  const RgbImage all = assembled(panels);
  write_png(out->file("figure.png"), all.width_px, all.height_px, all.rgb);
  return sheets;
}

void draw_and_report(const RenderArguments& arguments, const Subject& subject, Renderer* renderer) {
  const Rig& rig = renderer->config().rig;
  const int num_views = static_cast<int>(subject.views.size()), num_cameras = static_cast<int>(rig.cameras.size());
  HostImages images(rig, num_views, PixelFormat::u8, arguments.planes.empty() ? Planes::none : Planes::all);
  const double rate = draw(subject, renderer, &images);
  FilledFolder out(arguments.out, "render");
  const std::vector<std::string> sheets = write_pictures(arguments, subject, rig, images, &out);
  out.remove_others();

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
    print_result("{} images in {}, contact sheet {}; {} agent-steps/s drawn by {}; image hash {}\n",
                 num_views * num_cameras, arguments.out, fmt::join(sheets, ", "), format_count(rate), renderer->name(),
                 hash.hex());
  }
}

void render_scene_file(const RenderArguments& arguments) {
  const SceneFile file = load_scene(arguments.world.map);
  const auto renderer = open_renderer(arguments, file.config);
  draw_and_report(arguments, {{file.geometry}, file.scene.batch(), file.views, file.view_names, file.view_captions},
                  renderer.get());
}

/// Returns the renderer configuration for worlds on maps.
RendererConfig config_of(const RenderArguments& arguments) {
  const Pair size = parse_pair("--size", arguments.size, 8192);
  if (!arguments.rig.empty() && arguments.size_given) fail_usage("--size: the rig of --rig has its own sizes");
  if (!arguments.rig.empty() && arguments.square_pixels) fail_usage("--square-pixels: has no effect with --rig");
  RendererConfig config;
  config.rig =
      arguments.rig.empty() ? paper_rig(size.first, size.second, arguments.square_pixels) : load_rig(arguments.rig);
  config.line_floor_px = arguments.line_floor_px;
  return config;
}

void render_world(const RenderArguments& arguments) {
  if (arguments.views > arguments.world.agents) {
    fail_usage("--views: expected 1 to {} (one per agent), got {}", arguments.world.agents, arguments.views);
  }
  const auto renderer = open_renderer(arguments, config_of(arguments));
  DrivenWorld world = make_world(arguments.world, "random");
  Simulator* const simulator = world.simulator.get();
  const DriveEnd end = drive_steps(*simulator, *world.controller, arguments.steps);
  if (end.is_interrupted) throw Interrupted(fmt::format("interrupted at step {} of {}", end.steps, arguments.steps));

  Subject subject{
      {simulator->maps()[0]->geometry}, simulator->scene(), simulator->views().subspan(0, arguments.views), {}, {}};
  for (int view = 0; view < arguments.views; ++view) subject.names.push_back(fmt::format("agent{:03}", view));
  subject.captions = subject.names;
  draw_and_report(arguments, subject, renderer.get());
}

/// Returns which tracks of a recorded scene are drawn, as [tracks].
std::vector<uint8_t> viewed_tracks(const RenderArguments& arguments, const CompiledMap& map) {
  const Scenario& scenario = *map.scenario;
  if (arguments.tracks.empty() && scenario.sdc_track < 0) {
    // The file does not mark a self-driving car, so the first track is drawn.
    std::vector<uint8_t> first = tracks_of(scenario, "all", map.start_step);
    std::fill(std::find(first.begin(), first.end(), 1) + 1, first.end(), 0);
    return first;
  }
  try {
    return tracks_of(scenario, arguments.tracks.empty() ? "self" : arguments.tracks, map.start_step);
  } catch (const UsageError& error) {
    fail_usage("--tracks: {}", error.what());
  }
}

void render_recorded_scene(const RenderArguments& arguments) {
  const RendererConfig config = config_of(arguments);
  DrivenWorld world = make_world(arguments.world, "log");
  const CompiledMap& map = *world.simulator->maps()[0];
  const std::vector<uint8_t> looks = viewed_tracks(arguments, map);
  const auto renderer = open_renderer(arguments, config);
  Subject subject{{map.geometry}, world.simulator->scene(), {}, {}, {}};
  std::vector<View> views;
  for (size_t i = 0; i < looks.size(); ++i) {
    if (!looks[i]) continue;
    const RecordedTrack& track = map.scenario->tracks[i];
    views.push_back(world.simulator->views()[i]);
    subject.names.push_back(fmt::format("track{}", track.id));
    subject.captions.push_back(fmt::format("{} {}, step {}", to_string(track.type), track.id, map.start_step));
  }
  subject.views = views;
  draw_and_report(arguments, subject, renderer.get());
}

// Rejects options of worlds, because a scene file determines its world.
void reject_world_options(const CLI::App& command) {
  reject_options(command,
                 {"--agents", "--pedestrians", "--cyclists", "--parked", "--seed", "--no-walls", "--light-cycles",
                  "--light-heads", "--steps", "--views", "--size", "--square-pixels", "--rig", "--line-floor",
                  "--simulator", "--start", "--recorded-lights", "--tracks"},
                 "on a scene file, which defines it");
}

}  // namespace

void add_render_command(CLI::App& app) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Write camera images of agents");
  add_map_or_scene(command, &arguments->world.map, "a scene file (.toml), ");
  add_world_options(command, &arguments->world);
  add_light_cycles_option(command, &arguments->world.light_cycles, name_of(SimulatorConfig{}.light_cycles));
  add_light_heads_option(command, &arguments->world.light_heads);
  add_number_option(command, "--steps", arguments->steps,
                    "Number of steps with random actions before the images are drawn", 0);
  add_number_option(command, "--views", arguments->views, "Number of agents whose cameras are drawn", 1);
  add_scene_options(command, &arguments->world);
  command->add_option(
      "--tracks", arguments->tracks,
      "Tracks of a recorded scene whose cameras are drawn, separated by commas: self (the self-driving car), vehicles "
      "(all other vehicles), others (non-vehicles), all, tracks_to_predict, objects_of_interest, and ids; only tracks "
      "that are present at --start; default: self, or the first track if the file does not mark self");
  CLI::Option* size =
      command->add_option("--size", arguments->size, "Image size in pixels, WxH")->capture_default_str();
  command->add_flag("--square-pixels", arguments->square_pixels,
                    "If the image size is not 16:9, keep pixels square and keep the horizontal field of view");
  add_backend_options(command, "auto", &arguments->world);
  command->add_option("--rig", arguments->rig, "TOML file with [[camera]] tables instead of the paper's four cameras");
  add_number_option(command, "--line-floor", arguments->line_floor_px,
                    "Minimum width of a line in images, in pixels; 0: no minimum", 0, kMaxLineFloor_px);
  command->add_option("--planes", arguments->planes, "Also write these planes as pictures: depth, class, instance")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(one_of({"depth", "class", "instance"}));
  command->add_flag("--figure", arguments->figure,
                    "Also write VIEW.png for each view, with the enlarged image of its first camera and a caption, and "
                    "figure.png, which combines these pictures");
  command->add_option("--out", arguments->out, "Folder for the pictures; pictures of an earlier call are removed")
      ->required();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura render Town01 --agents 80 --steps 100 --views 6 --size 192x108 --out images\n"
      "  pictura render procedural:1 --agents 40 --steps 20 --views 2 --out images\n"
      "  pictura render tests/golden/crossing.toml --backend cpu --planes depth,class --out images\n"
      "  pictura render validation.tfrecord-00000-of-00150#7 --start 10 --tracks self,1014 --out images");
  command->callback([arguments, size, command] {
    const OutputFolder folder(arguments->out);
    if (is_scene_file(arguments->world.map)) {
      reject_world_options(*command);
      return render_scene_file(*arguments);
    }
    arguments->size_given = size->count() > 0;
    arguments->world.vector_observations = false;
    if (is_scene_name(arguments->world.map)) {
      reject_options(*command,
                     {"--agents", "--pedestrians", "--cyclists", "--parked", "--seed", "--no-walls", "--light-cycles",
                      "--light-heads", "--steps", "--views"},
                     "on a recorded scene, which defines it: --start and --tracks select from the scene");
      return render_recorded_scene(*arguments);
    }
    reject_scene_options(*command, arguments->world.map, {"--tracks"});
    render_world(*arguments);
  });
}

}  // namespace pictura
