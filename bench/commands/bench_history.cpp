// `pictura bench history`: measures rates of drawing random agents of random steps from a scene history, and rates of
// drawing agents of the current scene.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/bench/commands/plot_results.h"
#include "pictura/bench/history.h"
#include "pictura/bench/render.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/driving/world.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

struct HistoryArguments {
  WorldOptions world = bench_world(/*num_threads=*/0, /*share=*/0.1f, /*parked_cars=*/32);
  std::vector<std::string> maps;
  std::string size = "96x54";
  int slots = 20480;
  HistoryCase measured;
  RateArguments rate;
};

void run_history(HistoryArguments arguments) {
  HistoryCase& measured = arguments.measured;
  const WorldOptions& world = arguments.world;
  check_backends({measured.backend}, {"cpu", "cuda"});
  const Pair pixels = parse_pair("--size", arguments.size, 8192);
  measured.rig = paper_rig(pixels.first, pixels.second);
  measured.repeats = arguments.rate.repeats;
  measured.repeat_s = arguments.rate.repeat_s;
  apply_world_options(world, &measured.simulator);
  measured.simulator.vector_observations = false;
  const std::vector<std::string> names = named_maps(arguments.maps);
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& name : names) maps.push_back(load_map(name));
  measured.maps = compile_maps(maps, {.walls = world.walls}, world.num_threads);
  measured.worlds = draw_worlds(world.seed, arguments.slots, 1, world.agents, static_cast<int>(maps.size()));

  ProgressLine progress;
  progress.update("driving and measuring");
  const HistoryMeasurement measurement = measure_history(measured);
  progress.finish();

  const std::string name = fmt::format("{} {} {} views", measured.backend, arguments.size, measured.num_views);
  BenchResult present{name + ", present scene", "agent_steps_per_s", {}},
      history{fmt::format("{}, history of {} steps", name, measured.num_steps), "agent_steps_per_s", {}},
      ratio{name + ", history over present", "ratio", {}}, call{name + ", one call of the history", "ms", {}};
  for (std::size_t i = 0; i < measurement.present_ms.size(); ++i) {
    const double views_1000 = 1e3 * measured.num_views;
    present.values.push_back(views_1000 / measurement.present_ms[i]);
    history.values.push_back(views_1000 / measurement.history_ms[i]);
    ratio.values.push_back(measurement.present_ms[i] / measurement.history_ms[i]);
    call.values.push_back(measurement.history_ms[i]);
  }
  const BenchResult memory{name + ", memory of the history", "GB", {measurement.history_bytes / 1e9}};
  BenchContext context{
      .workload = fmt::format(
          "history: {}, {} agents in {} worlds of 1 to {}, {} parked cars, walls {}, random actions with resets, "
          "{} cameras, u8; images of {} agents out of the history equal those drawn at the time; {}",
          fmt::join(names, " "), arguments.slots, measured.worlds.size(), world.agents, *world.parked_cars,
          world.walls ? "on" : "off", measured.rig.cameras.size(), measured.checked_images, measurement.choice),
      .backend = measured.backend};
  if (measured.backend == "cuda") context.add_gpu(cuda_device_name(), cuda_driver_name());
  report_benchmark(arguments.rate.json, context, {present, history, ratio, call, memory});
}

}  // namespace

void add_history_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<HistoryArguments>();
  HistoryCase& measured = arguments->measured;
  CLI::App* command = bench.add_subcommand(
      "history", "Images of random agents of random steps, compared with images of the present scene");
  add_maps_option(command, &arguments->maps);
  add_world_options(command, &arguments->world);
  command->add_option("--backend", measured.backend, "cpu or cuda: simulator, history and renderer")
      ->capture_default_str();
  add_number_option(command, "--slots", arguments->slots, "Total number of agents, in worlds of 1 to --agents", 1,
                    kMaxSlots);
  add_number_option(command, "--steps", measured.num_steps, "Steps of the history", 1, 1 << 16);
  add_number_option(command, "--warm-up", measured.warm_up_steps, "Steps before the history begins", 0);
  add_number_option(command, "--views", measured.num_views, "Agents drawn in one call", 1, kMaxSlots);
  command->add_option("--size", arguments->size, "Pixels of an image, WxH")->capture_default_str();
  add_number_option(command, "--check", measured.checked_images,
                    "Number of agents whose images are compared with those drawn at the time", 1, 1 << 16);
  add_repeat_options(command, &arguments->rate);
  command->footer(
      "Examples:\n  pictura bench history --slots 240 --views 64 --repeats 3\n"
      "  pictura bench history --size 32x18\n"
      "  pictura bench history --backend cuda --map towns --json");
  command->callback([arguments] { run_history(*arguments); });
}

}  // namespace pictura
