// `pictura bench soak`: compares a renderer with the CPU renderer for minutes, on random scenes from a seed.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/commands/bench.h"
#include "pictura/bench/render.h"
#include "pictura/bench/soak.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"

namespace pictura {

namespace {

struct SoakArguments {
  std::string backend = "cuda";
  SoakOptions soak;
  double minutes = 8;
  bool json = false;
};

void print_soak(const SoakArguments& arguments, const SoakResult& result) {
  if (arguments.json) {
    Json faults = Json::array();
    for (const SoakFault& fault : result.faults) {
      faults.push_back({{"scene", fault.scene},
                        {"view", fault.view},
                        {"camera", fault.camera},
                        {"worst", fault.error.worst},
                        {"values_beyond_1_255", fault.error.beyond},
                        {"differing_plane_pixels", fault.error.differing_plane_pixels}});
    }
    Json visibility_faults = Json::array();
    for (const VisibilityFault& fault : result.visibility_faults) {
      visibility_faults.push_back({{"scene", fault.scene},
                                   {"view", fault.query.view},
                                   {"agent", fault.query.agent},
                                   {"visibility", fault.answer},
                                   {"expected", fault.expected}});
    }
    BenchContext context{.workload = fmt::format("soak: {}, at most {} agents, {} views a scene, seed {}; {}",
                                                 fmt::join(arguments.soak.maps, " "), arguments.soak.agents,
                                                 arguments.soak.views, arguments.soak.seed, result.choice),
                         .backend = arguments.backend};
    context.add_gpu(cuda_device_name(), cuda_driver_name());
    Json object = context.json();
    object.update({{"seconds", result.seconds},
                   {"scenes", result.scenes},
                   {"images", result.images},
                   {"values", result.error.values},
                   {"differing_values", result.error.differing},
                   {"worst", result.error.worst},
                   {"plane_pixels", result.error.plane_pixels},
                   {"differing_plane_pixels", result.error.differing_plane_pixels},
                   {"images_out_of_tolerance", result.images_out_of_tolerance},
                   {"visibility_queries", result.queries},
                   {"differing_answers", result.differing_answers},
                   {"faults", faults},
                   {"visibility_faults", visibility_faults}});
    return print_json(object);
  }
  print_result(
      "{}: {} images of {} scenes in {:.0f} s, {} of {} values differ from the oracle's, worst {:.2f}/255; planes "
      "differ "
      "at {} of {} pixels; {} of {} visibilities differ\n{}\n",
      arguments.backend, result.images, result.scenes, result.seconds, result.error.differing, result.error.values,
      255 * result.error.worst, result.error.differing_plane_pixels, result.error.plane_pixels,
      result.differing_answers, result.queries, result.choice);
  for (const SoakFault& fault : result.faults) {
    print_result(
        "scene {} view {} camera {}: {} of {} values off by more than 1/255, worst {:.2f}/255; planes differ at {} of "
        "{} pixels\n",
        fault.scene, fault.view, fault.camera, fault.error.beyond, fault.error.values, 255 * fault.error.worst,
        fault.error.differing_plane_pixels, fault.error.plane_pixels);
  }
  for (const VisibilityFault& fault : result.visibility_faults) {
    print_result("scene {} view {} agent {}: visibility {}, expected {}\n", fault.scene, fault.query.view,
                 fault.query.agent, fault.answer, fault.expected);
  }
}

void run_soak(SoakArguments arguments) {
  SoakOptions& options = arguments.soak;
  check_backends({arguments.backend}, renderer_names());
  options.maps = named_maps(options.maps);
  options.max_seconds = 60 * arguments.minutes;
  ProgressLine progress;
  auto make = [&](const RendererConfig& config, std::string* choice_out) {
    return make_renderer(arguments.backend, config, choice_out);
  };
  const SoakResult result = soak(options, make, [&](const SoakResult& so_far) {
    const double of_time = so_far.seconds / options.max_seconds;
    const double of_scenes =
        options.max_scenes > 0 ? static_cast<double>(so_far.scenes) / static_cast<double>(options.max_scenes) : 0.0;
    progress.update(fmt::format("{} images, {} out of tolerance", so_far.images,
                                so_far.images_out_of_tolerance + so_far.differing_answers),
                    std::min(1.0, std::max(of_time, of_scenes)));
  });
  progress.finish();
  print_soak(arguments, result);
  PICTURA_CHECK(
      result.first_faulty_scene < 0,
      "bench soak: {} of {} images are out of tolerance and {} of {} visibilities differ; to repeat the first: "
      "--first {} --scenes 1",
      result.images_out_of_tolerance, result.images, result.differing_answers, result.queries,
      result.first_faulty_scene);
}

}  // namespace

void add_soak_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<SoakArguments>();
  SoakOptions& soak = arguments->soak;
  CLI::App* command = bench.add_subcommand("soak", "Compare a renderer with the oracle on random scenes for minutes");
  command->add_option("--backend", arguments->backend, "The renderer")->capture_default_str();
  add_maps_option(command, &soak.maps);
  add_number_option(command, "--minutes", arguments->minutes, "Time limit", 1e-3, 1e5);
  add_number_option(command, "--scenes", soak.max_scenes, "Maximum number of scenes; 0: limited by time only", 0);
  add_number_option(command, "--first", soak.first_scene,
                    "Number of the first scene; a number gives the same scene in every run", 0);
  add_number_option(command, "--agents", soak.agents, "Maximum number of agents per world", 1, kMaxAgentsPerWorld);
  add_number_option(command, "--views", soak.views, "Views per scene", 1, 4096);
  add_seed_option(command, &soak.seed, "Seed of the worlds");
  add_threads_option(command, &soak.num_threads);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Exits with status 1 if an image differs from the oracle's by more than kernels may: by more than 1/255 at one\n"
      "value in 10,000, by more than 4/255 anywhere, or in the planes of one pixel in 10,000; or if the visibility of\n"
      "an agent differs.\n"
      "Examples:\n  pictura bench soak --map towns --minutes 8\n"
      "  pictura bench soak --backend cuda --minutes 1 --json\n"
      "  pictura bench soak --first 17 --scenes 1");
  command->callback([arguments] { run_soak(*arguments); });
}

}  // namespace pictura
