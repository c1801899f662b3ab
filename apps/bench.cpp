// `pictura bench`: rates of rendering, simulation and training as medians of several repeats, with the device's name,
// the commit and the workload beside them.
#include "pictura/apps/bench.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "pictura/apps/commands.h"
#include "pictura/apps/drive.h"
#include "pictura/apps/report.h"
#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/common/interrupt.h"
#include "pictura/map/load_map.h"
#ifdef PICTURA_HAS_TORCH
#include "pictura/training/training.h"
#endif

namespace pictura {

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

std::string population_of(const WorldOptions& world) {
  const float pedestrians = *world.pedestrian_fraction, cyclists = *world.cyclist_fraction;
  std::string text = fmt::format("{} agents", world.agents);
  if (pedestrians > 0 || cyclists > 0) text += fmt::format(" ({} pedestrians, {} cyclists)", pedestrians, cyclists);
  if (*world.parked_cars > 0) text += fmt::format(", {} parked cars", *world.parked_cars);
  return text;
}

std::string default_benchmark_map() {
  const std::vector<std::string> towns = known_towns();
  return std::binary_search(towns.begin(), towns.end(), "Town01") ? "Town01" : "procedural:1";
}

void report_benchmark(bool json, const BenchContext& context, std::vector<BenchResult> results) {
  Json rows = Json::array();
  for (BenchResult& result : results) {
    std::sort(result.values.begin(), result.values.end());
    const size_t n = result.values.size();
    const double median = 0.5 * (result.values[(n - 1) / 2] + result.values[n / 2]);
    const double mean = std::accumulate(result.values.begin(), result.values.end(), 0.0) / static_cast<double>(n);
    rows.push_back({{"name", result.name},
                    {"value", median},
                    {"unit", result.unit},
                    {"mean", mean},
                    {"min", result.values.front()},
                    {"max", result.values.back()},
                    {"repeats", n}});
  }
  if (json) {
    Json object{{"workload", context.workload}, {"backend", context.backend}, {"device", context.device}};
    if (!context.driver.empty()) object["driver"] = context.driver;
    object["commit"] = PICTURA_COMMIT;
    object["results"] = rows;
    return print_json(object);
  }
  fmt::print("{}\nbackend {} on {}{}, commit {}\n", context.workload, context.backend, context.device,
             context.driver.empty() ? "" : ", driver " + context.driver, PICTURA_COMMIT);
  for (const Json& row : rows) {
    fmt::print("{:50} {:>14.6g} {:18} (mean {:.6g}, min {:.6g}, max {:.6g}, {} repeats)\n",
               row["name"].get<std::string>(), row["value"].get<double>(), row["unit"].get<std::string>(),
               row["mean"].get<double>(), row["min"].get<double>(), row["max"].get<double>(),
               row["repeats"].get<int>());
  }
}

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

struct Arguments {
  // Vehicles alone, as the peers that rates are compared with; what a world of all classes costs is an option.
  WorldOptions world{
      .agents = 120, .num_threads = 1, .pedestrian_fraction = 0.0f, .cyclist_fraction = 0.0f, .parked_cars = 0};
  int repeats = 7;
  double repeat_s = 1.0;
  std::string config = "configs/smoke.toml";
  bool json = false;
};

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
                   {fmt::format("simulate: {}, {}, random actions with resets, {} threads", arguments.world.map,
                                population_of(arguments.world), arguments.world.num_threads),
                    "cpu"},
                   results);
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
  report_benchmark(arguments.json, {fmt::format("train: {}, rollout and update", arguments.config), "cpu"}, {rate});
}
#endif

}  // namespace

void add_bench_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "bench",
      "Measure rates, quality and worlds: bench render, bench simulate, bench train, bench quality, bench worlds");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  pictura bench simulate --map Town01 --agents 120 --json\n  pictura bench render --size 192x108");
  auto add = [command](const std::string& name, const std::string& help, void (*run)(const Arguments&)) {
    auto arguments = std::make_shared<Arguments>();
    CLI::App* sub = command->add_subcommand(name, help);
    sub->add_flag("--json", arguments->json, "Print one JSON object");
    sub->callback([arguments, run] {
      if (arguments->world.map.empty()) arguments->world.map = default_benchmark_map();
      run(*arguments);
    });
    return std::pair{sub, arguments};
  };
  const auto [simulate, simulate_arguments] =
      add("simulate", "Steps of a world, observations included", bench_simulate);
  simulate->add_option("--map", simulate_arguments->world.map, "Default: Town01 where it is found, else procedural:1");
  add_world_options(simulate, &simulate_arguments->world);
  simulate->add_option("--repeats", simulate_arguments->repeats)->check(CLI::PositiveNumber)->capture_default_str();
  simulate->add_option("--repeat-seconds", simulate_arguments->repeat_s)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
#ifdef PICTURA_HAS_TORCH
  const auto [train_command, train_arguments] = add("train", "Rollouts and updates of a configuration", bench_train);
  train_command->add_option("--config", train_arguments->config, "TOML file")->capture_default_str();
#endif
#ifdef PICTURA_HAS_BENCH
  add_quality_benchmark(*command);
  add_render_benchmark(*command);
  add_worlds_benchmark(*command);
#endif
}

}  // namespace pictura
