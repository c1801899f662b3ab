// `pictura bench`: rates of rendering, simulation and training as medians of several repeats, with the device's name,
// the commit and the workload beside them.
#include "pictura/apps/bench.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "pictura/apps/commands.h"
#include "pictura/apps/drive.h"
#include "pictura/apps/report.h"
#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/common/interrupt.h"
#include "pictura/common/make_renderer.h"
#include "pictura/map/load_map.h"
#ifdef PICTURA_HAS_TORCH
#include "pictura/training/training.h"
#endif

namespace pictura {

namespace {

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

}  // namespace

void report_benchmark(bool json, const std::string& workload, const std::string& backend,
                      std::vector<BenchResult> results) {
  Json rows = Json::array();
  for (BenchResult& result : results) {
    std::sort(result.values.begin(), result.values.end());
    const size_t n = result.values.size();
    const double median = 0.5 * (result.values[(n - 1) / 2] + result.values[n / 2]);
    rows.push_back({{"name", result.name},
                    {"value", median},
                    {"unit", result.unit},
                    {"min", result.values.front()},
                    {"max", result.values.back()},
                    {"repeats", n}});
  }
  if (json) {
    return print_json({{"workload", workload},
                       {"backend", backend},
                       {"device", processor_name()},
                       {"commit", PICTURA_COMMIT},
                       {"results", rows}});
  }
  fmt::print("{}\nbackend {} on {}, commit {}\n", workload, backend, processor_name(), PICTURA_COMMIT);
  for (const Json& row : rows) {
    fmt::print("{:32} {:>14.6g} {:18} (min {:.6g}, max {:.6g}, {} repeats)\n", row["name"].get<std::string>(),
               row["value"].get<double>(), row["unit"].get<std::string>(), row["min"].get<double>(),
               row["max"].get<double>(), row["repeats"].get<int>());
  }
}

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

struct Arguments {
  // Vehicles alone, as the peers that rates are compared with; what a world of all classes costs is an option.
  WorldOptions world{
      .agents = 120, .num_threads = 1, .pedestrian_fraction = 0.0f, .cyclist_fraction = 0.0f, .parked_cars = 0};
  std::string backend = "cpu", size = "96x54", samples = "1";
  int repeats = 7;
  double repeat_s = 1.0;
  std::string config = "configs/smoke.toml";
  bool json = false;
};

/// In words, for the workload of a result.
std::string population_of(const WorldOptions& world) {
  const float pedestrians = *world.pedestrian_fraction, cyclists = *world.cyclist_fraction;
  std::string text = fmt::format("{} agents", world.agents);
  if (pedestrians > 0 || cyclists > 0) text += fmt::format(" ({} pedestrians, {} cyclists)", pedestrians, cyclists);
  if (*world.parked_cars > 0) text += fmt::format(", {} parked cars", *world.parked_cars);
  return text;
}

/// Where no map is named: the town that the numbers of docs/ are about, or the procedural one where it is missing.
std::string default_map() {
  const std::vector<std::string> towns = known_towns();
  return std::binary_search(towns.begin(), towns.end(), "Town01") ? "Town01" : "procedural:1";
}

void advance(Simulator* simulator, Pilot* pilot, int steps, std::vector<int32_t>* actions_inout) {
  actions_inout->resize(static_cast<size_t>(simulator->num_slots()));
  for (int step = 0; step < steps; ++step) {
    pilot->act(*simulator, *actions_inout);
    simulator->step(*actions_inout);
  }
}

void bench_simulate(const Arguments& arguments) {
  std::vector<BenchResult> results;
  for (const bool vector_observations : {true, false}) {
    WorldOptions world = arguments.world;
    world.vector_observations = vector_observations;
    const auto pilot = make_pilot("random", world.seed, "cpu", world.num_threads);
    const auto simulator = make_world(world, pilot.get());
    std::vector<int32_t> actions;
    advance(simulator.get(), pilot.get(), 20, &actions);
    const std::string suffix = vector_observations ? "" : " without entity sets";
    BenchResult live{"step" + suffix, "agent_steps_per_s", {}},
        slots{"step" + suffix + ", slots", "slot_steps_per_s", {}};
    for (int repeat = 0; repeat < arguments.repeats; ++repeat) {
      const SimulatorTotals before = simulator->totals();
      const auto begin = Clock::now();
      double elapsed_s = 0;
      while (elapsed_s < arguments.repeat_s) {
        advance(simulator.get(), pilot.get(), 20, &actions);
        elapsed_s = seconds_since(begin);
      }
      live.values.push_back(static_cast<double>(simulator->totals().agent_steps - before.agent_steps) / elapsed_s);
      slots.values.push_back(static_cast<double>(simulator->totals().slot_steps - before.slot_steps) / elapsed_s);
      if (interrupted()) throw Interrupted("interrupted");
    }
    results.push_back(live);
    results.push_back(slots);
  }
  report_benchmark(arguments.json,
                   fmt::format("simulate: {}, {}, random actions with resets, {} threads", arguments.world.map,
                               population_of(arguments.world), arguments.world.num_threads),
                   "cpu", results);
}

void bench_render(const Arguments& arguments) {
  const Pair size = parse_pair("--size", arguments.size, 8192);
  WorldOptions world = arguments.world;
  world.vector_observations = false;
  const auto pilot = make_pilot("random", world.seed, "cpu", world.num_threads);
  const auto simulator = make_world(world, pilot.get());
  std::vector<int32_t> actions;
  advance(simulator.get(), pilot.get(), 30, &actions);
  const RendererConfig config{.rig = paper_rig(size.first, size.second),
                              .num_threads = world.num_threads,
                              .samples = parse_samples("--samples", arguments.samples)};
  std::string choice;
  const auto renderer = make_renderer(arguments.backend, config, &choice);
  PICTURA_CHECK(renderer->space() == MemorySpace::host, "bench render: expected a host backend, got {}",
                renderer->name());
  upload_geometries(simulator->geometries(), renderer.get());
  const Span<const View> views = simulator->views();
  HostImages images(renderer->config().rig, static_cast<int>(views.size()));
  renderer->render(simulator->scene(), views, images.batch());  // warm-up
  BenchResult rate{"render", "agent_steps_per_s", {}}, image_ms{"one image", "ms", {}};
  for (int repeat = 0; repeat < arguments.repeats; ++repeat) {
    const auto begin = Clock::now();
    double elapsed_s = 0;
    int calls = 0;
    while (elapsed_s < arguments.repeat_s) {
      renderer->render(simulator->scene(), views, images.batch());
      ++calls;
      elapsed_s = seconds_since(begin);
    }
    const double agent_steps = static_cast<double>(views.size()) * calls;
    rate.values.push_back(agent_steps / elapsed_s);
    image_ms.values.push_back(1e3 * elapsed_s /
                              (agent_steps * static_cast<double>(renderer->config().rig.cameras.size())));
    if (interrupted()) throw Interrupted("interrupted");
  }
  report_benchmark(arguments.json,
                   fmt::format("render: {}, {}, walls {}, all egos x {} cameras x {}, {} threads, samples {}, {}",
                               world.map, population_of(world), world.walls ? "on" : "off", config.rig.cameras.size(),
                               arguments.size, world.num_threads, arguments.samples, choice),
                   std::string(renderer->name()), {rate, image_ms});
}

#ifdef PICTURA_HAS_TORCH
void bench_train(const Arguments& arguments) {
  const std::string folder = std::filesystem::temp_directory_path() / fmt::format("pictura-bench-{}", getpid());
  BenchResult rate{"train, one update", "agent_steps_per_s", {}};
  TrainOptions options{.config_path = arguments.config, .out_folder = folder};
  int64_t steps_before = 0;
  auto begin = Clock::now();
  options.on_progress = [&](const TrainProgress& progress) {
    // The first update warms caches and allocators up.
    if (progress.update > 1)
      rate.values.push_back(static_cast<double>(progress.agent_steps - steps_before) / seconds_since(begin));
    steps_before = progress.agent_steps;
    begin = Clock::now();
  };
  const TrainReport trained = train(options);
  std::filesystem::remove_all(folder);
  if (trained.interrupted) throw Interrupted("interrupted");
  PICTURA_CHECK(!rate.values.empty(), "bench train: {}: expected at least 2 updates", arguments.config);
  report_benchmark(arguments.json, fmt::format("train: {}, rollout and update", arguments.config), "cpu", {rate});
}
#endif

}  // namespace

void add_bench_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "bench", "Measure rates and quality: bench render, bench simulate, bench train, bench quality");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  pictura bench simulate --map Town01 --agents 120 --json\n  pictura bench render --size 192x108");
  auto add = [command](const std::string& name, const std::string& help, void (*run)(const Arguments&)) {
    auto arguments = std::make_shared<Arguments>();
    CLI::App* sub = command->add_subcommand(name, help);
    sub->add_flag("--json", arguments->json, "Print one JSON object");
    sub->callback([arguments, run] {
      if (arguments->world.map.empty()) arguments->world.map = default_map();
      run(*arguments);
    });
    return std::pair{sub, arguments};
  };
  auto add_world = [](CLI::App* sub, Arguments* arguments) {
    sub->add_option("--map", arguments->world.map, "Default: Town01 where it is found, else procedural:1");
    add_world_options(sub, &arguments->world);
    sub->add_option("--repeats", arguments->repeats)->check(CLI::PositiveNumber)->capture_default_str();
    sub->add_option("--repeat-seconds", arguments->repeat_s)->check(CLI::PositiveNumber)->capture_default_str();
  };
  const auto [render, render_arguments] = add("render", "Images of every agent of a world", bench_render);
  add_world(render, render_arguments.get());
  render->add_option("--backend", render_arguments->backend)->capture_default_str();
  render->add_option("--size", render_arguments->size, "WxH in pixels")->capture_default_str();
  render->add_option("--samples", render_arguments->samples, "Of a pixel, for gl: 1, N (MSAA) or NxN (supersampling)")
      ->capture_default_str();
  const auto [simulate, simulate_arguments] =
      add("simulate", "Steps of a world, observations included", bench_simulate);
  add_world(simulate, simulate_arguments.get());
#ifdef PICTURA_HAS_TORCH
  const auto [train_command, train_arguments] = add("train", "Rollouts and updates of a configuration", bench_train);
  train_command->add_option("--config", train_arguments->config, "TOML file")->capture_default_str();
#endif
#ifdef PICTURA_HAS_BENCH
  add_quality_benchmark(*command);
#endif
}

}  // namespace pictura
