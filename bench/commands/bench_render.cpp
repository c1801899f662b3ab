// `pictura bench render`: measures rates of drawing the images of agents in many worlds, by backend, image size and
// number of egos (agents with images), and the used device memory.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/commands/bench.h"
#include "pictura/bench/commands/plot_results.h"
#include "pictura/bench/render.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/driving/world.h"

namespace pictura {

namespace {

struct RenderArguments {
  WorldOptions world = bench_world(/*num_threads=*/1, /*share=*/0, /*parked_cars=*/0);
  std::vector<std::string> maps, backends = {"cpu"}, sizes, samples = {"1"};
  std::vector<int> egos, crowds = {0};  // crowds: agents per world; 0: the number in `world`
  std::string sweep, format = "u8";
  int patch_px = 0;  // 0: planar images
  int checked_views = 8;
  bool planes = false, host_memory = false, memory = false;
  RateArguments rate;
  std::optional<EarlierReport> earlier;
};

// Fixed values: sweeps over sizes use kSweptEgos, and sweeps over egos use kSweptSize.
constexpr int kSweptEgos = 2048;
constexpr const char* kSweptSize = "96x54";

// Sets the cases of a sweep: those of the Pictura paper and larger cases, see docs/developer/benchmarks.md.
void apply_sweep(RenderArguments* arguments) {
  const std::string& sweep = arguments->sweep;
  if (sweep.empty()) return;
  if (sweep == "crowd") {
    arguments->crowds.assign(std::begin(kCrowds), std::end(kCrowds));
    return;
  }
  if (!arguments->sizes.empty() || (sweep == "egos" && !arguments->egos.empty())) {
    fail_usage("--sweep {}: chooses sizes or egos itself", sweep);
  }
  if (sweep == "egos") {
    arguments->egos = {64, 128, 256, 512, 1024, 2048, 4096, 8192, 20480};
    return;
  }
  if (sweep == "squares") {
    arguments->sizes = {"32x32", "64x64", "128x128", "256x256"};
    arguments->world.walls = false;
  } else {
    arguments->sizes = {"32x18", "64x36", "96x54", "192x108", "384x216", "768x432"};
  }
  if (arguments->egos.empty()) arguments->egos = {kSweptEgos};
}

void apply_defaults(RenderArguments* arguments) {
  apply_sweep(arguments);
  if (arguments->sizes.empty()) arguments->sizes = {kSweptSize};
  if (arguments->egos.empty()) arguments->egos = {0};
  arguments->maps = named_maps(arguments->maps);
}

bool draws_in_device_memory(const std::string& backend) { return backend == "cuda" || backend == "gl:egl"; }

RenderCase case_of(const RenderArguments& arguments, const std::string& backend, const std::string& size,
                   const std::string& samples, int egos) {
  const Pair pixels = parse_pair("--size", size, 8192);
  RenderCase result{.backend = backend, .num_views = egos};
  result.config.rig = paper_rig(pixels.first, pixels.second, /*square_pixels=*/arguments.sweep == "squares");
  const bool in_device_memory =
      draws_in_device_memory(backend) && !arguments.host_memory && !cuda_device_name().empty();
  if (in_device_memory) result.config.device = {MemorySpace::cuda, 0};
  result.config.num_threads = arguments.world.num_threads;
  result.config.samples = parse_samples("--samples", samples);
  result.format = arguments.format == "u8"     ? PixelFormat::u8
                  : arguments.format == "f16"  ? PixelFormat::f16
                  : arguments.format == "bf16" ? PixelFormat::bf16
                                               : PixelFormat::f32;
  if (arguments.patch_px > 0) {
    result.order = ChannelOrder::patches;
    result.patch_px = arguments.patch_px;
  }
  result.planes = arguments.planes ? Planes::all : Planes::none;
  result.checked_views = arguments.checked_views;
  result.repeats = arguments.memory ? 0 : arguments.rate.repeats;
  result.repeat_s = arguments.rate.repeat_s;
  result.measures_memory = arguments.memory;
  return result;
}

struct NamedCase {
  std::string renderer, size;  // the backend, including its number of samples if it has samples
  int crowd = 0;               // agents per world if a sweep sets them
  RenderCase measured;         // if num_views is 0, all spawned agents have views
  std::string name() const {
    const std::string egos = fmt::format("{} {} {} egos", renderer, size, measured.num_views);
    return crowd > 0 ? fmt::format("{} of {} agents", egos, crowd) : egos;
  }
};

// Returns all cases. All arguments are checked here, so that errors are reported before the first case is measured.
std::vector<NamedCase> render_cases_of(const RenderArguments& arguments) {
  check_backends(arguments.backends, renderer_names());
  std::vector<NamedCase> cases;
  for (const std::string& backend : arguments.backends) {
    for (const std::string& samples : arguments.samples) {
      // Backends other than gl compute exact coverage, so they are measured only once for all numbers of samples.
      const bool takes_samples = backend.starts_with("gl");
      if (!takes_samples && samples != arguments.samples.front()) continue;
      for (const std::string& size : arguments.sizes) {
        for (const int crowd : arguments.crowds) {
          for (const int egos : arguments.egos) {
            cases.push_back({takes_samples ? backend + " " + samples : backend, size, crowd,
                             case_of(arguments, backend, size, takes_samples ? samples : "1", egos)});
          }
        }
      }
    }
  }
  if (arguments.memory && cases.size() > 1) {
    fail_usage(
        "--memory: expected one backend, size and number of egos and samples, because drivers keep memory that an "
        "earlier case has released; got {} cases",
        cases.size());
  }
  return cases;
}

void append_results(const std::string& name, const RenderCase& measured, const RenderMeasurement& measurement,
                    std::vector<BenchResult>* results_out) {
  BenchResult rate{name, "agent_steps_per_s", {}}, call{name + ", one call", "ms", {}},
      image{name + ", one image", "ms", {}};
  const double egos = measured.num_views, cameras = static_cast<double>(measured.config.rig.cameras.size());
  for (const double ms : measurement.call_ms) {
    rate.values.push_back(1e3 * egos / ms);
    call.values.push_back(ms);
    image.values.push_back(ms / (egos * cameras));
  }
  if (!measurement.call_ms.empty()) results_out->insert(results_out->end(), {rate, call, image});
  if (measurement.error.values > 0) {
    const double share =
        static_cast<double>(measurement.error.differing) / static_cast<double>(measurement.error.values);
    results_out->push_back({name + ", values unlike the oracle's", "%", {100 * share}});
    results_out->push_back({name + ", largest difference", "1/255", {255 * measurement.error.worst}});
    if (measured.planes == Planes::all) {
      results_out->push_back({name + ", planes unlike the oracle's",
                              "pixels",
                              {static_cast<double>(measurement.error.differing_plane_pixels)}});
    }
  }
  if (measured.measures_memory) {
    constexpr double kGiB = 1 << 30;
    results_out->push_back({name + ", up front", "GiB", {measurement.up_front_bytes / kGiB}});
    results_out->push_back({name + ", high-water mark beyond images", "GiB", {measurement.max_bytes / kGiB}});
    results_out->push_back({name + ", images", "GiB", {measurement.image_bytes / kGiB}});
  }
}

void run_render(RenderArguments arguments) {
  if (has_plot_arguments(arguments.rate.plot)) return draw_results("render_rates", arguments.rate.plot);
  apply_defaults(&arguments);
  std::vector<NamedCase> cases = render_cases_of(arguments);
  ProgressLine progress;
  const WorldOptions& world = arguments.world;
  const auto drive = [&](int crowd) {
    progress.update("driving");
    DrivenOptions driven{.maps = arguments.maps,
                         .num_views = *std::max_element(arguments.egos.begin(), arguments.egos.end()),
                         .agents = crowd > 0 ? crowd : world.agents};
    apply_world_options(world, &driven.simulator);
    driven.simulator.num_threads = 0;  // only drawing is measured
    return drive_worlds(driven);
  };
  DrivenWorlds worlds;
  std::vector<BenchResult> results;
  std::vector<std::string> choices;  // how each renderer was chosen in its last case
  for (std::size_t i = 0; i < cases.size(); ++i) {
    RenderCase& measured = cases[i].measured;
    if (i == 0 || cases[i].crowd != cases[i - 1].crowd) worlds = drive(cases[i].crowd);
    if (measured.num_views == 0) measured.num_views = static_cast<int>(worlds.views.size());
    progress.update(cases[i].name());
    const RenderMeasurement measurement = measure_render(worlds, measured);
    append_results(cases[i].name(), measured, measurement, &results);
    const bool is_last_of_renderer = i + 1 == cases.size() || cases[i + 1].renderer != cases[i].renderer;
    if (is_last_of_renderer) choices.push_back(measurement.choice);
  }
  progress.finish();
  BenchContext context{
      .workload = fmt::format(
          "render: {}, {} in each of {} worlds, walls {}, {} cameras, {}{}{}, {} threads; {}",
          fmt::join(arguments.maps, " "), arguments.sweep == "crowd" ? population_of_crowds() : population_of(world),
          worlds.simulator->worlds().size(), world.walls ? "on" : "off", paper_rig().cameras.size(), arguments.format,
          arguments.patch_px > 0 ? fmt::format(" in patches of {} px", arguments.patch_px) : "",
          arguments.planes ? " and planes" : "", world.num_threads, fmt::join(choices, "; ")),
      .backend = fmt::format("{}", fmt::join(arguments.backends, ","))};
  // If images are in host memory, gl:egl may run on any driver; the reported choice contains the driver's name.
  auto is_of_cuda_device = [](const NamedCase& each) {
    return each.measured.backend == "cuda" || !each.measured.config.device.is_host();
  };
  if (std::any_of(cases.begin(), cases.end(), is_of_cuda_device)) {
    context.add_gpu(cuda_device_name(), cuda_driver_name());
  }
  report_benchmark(arguments.rate.json, context, results, arguments.earlier);
}

}  // namespace

void add_render_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = bench.add_subcommand("render", "Images of the agents of many worlds");
  add_maps_option(command, &arguments->maps);
  add_world_options(command, &arguments->world);
  command->add_option("--egos", arguments->egos, "Agents drawn in one call; default: all of one world for each map")
      ->delimiter(',')
      ->transform(whole_number(1, kMaxSlots));
  command->add_option("--backend", arguments->backends, "cpu, cuda, gl, gl:egl, gl:osmesa")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--size", arguments->sizes, "Sizes in pixels, WxH; default: 96x54")->delimiter(',');
  command
      ->add_option("--samples", arguments->samples,
                   "Samples per pixel of the renderer gl: 1, N (MSAA) or NxN (supersampling)")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--format", arguments->format, "Type of a channel's value")
      ->check(one_of({"u8", "f16", "f32", "bf16"}).description("{u8,f16,f32,bf16}"))
      ->capture_default_str();
  add_number_option(
      command, "--patch", arguments->patch_px,
      "Draw patches of 4, 8, 12 or 16 px squared, the input of first convolutions; default: planar images", 4, 16)
      ->check(one_of({"4", "8", "12", "16"}).description("{4,8,12,16}"));
  command->add_flag("--planes", arguments->planes, "Draw depth, class and instance planes too");
  command->add_flag("--host-memory", arguments->host_memory,
                    "Keep scenes and images in host memory for cuda and gl:egl, which otherwise use device memory");
  command
      ->add_option("--sweep", arguments->sweep,
                   "sizes: the paper's five and 768x432; squares: without walls; egos: 64 to 20,480; crowd: all of one "
                   "world of 256 to 4,096")
      ->check(one_of({"sizes", "squares", "egos", "crowd"}).description("{sizes,squares,egos,crowd}"));
  command->add_flag("--memory", arguments->memory, "Measure device memory of a single case instead of rates");
  add_number_option(command, "--check", arguments->checked_views,
                    "Number of egos compared with the oracle, before and after timing", 0);
  add_rate_options(command, &arguments->rate);
  add_compare_option(command, &arguments->earlier);
  command->footer(
      "Examples:\n  pictura bench render --size 192x108 --threads 0\n"
      "  pictura bench render --sweep sizes --json\n"
      "  pictura bench render --backend cuda --size 96x54 --egos 2048 --format bf16 --patch 12\n"
      "  pictura bench render --backend cuda,gl:egl --samples 1,4,2x2 --map towns --parked 32 --egos 2048,256 --json");
  command->callback([arguments] { run_render(*arguments); });
}

}  // namespace pictura
