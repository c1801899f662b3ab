// `pictura bench`: rates of rendering, simulation and training as medians of several repeats, with device, commit and
// workload.
#include "pictura/bench/commands/bench.h"

#include <algorithm>
#include <fstream>
#include <numeric>

#include <fmt/ranges.h>

#include "pictura/cli/file_options.h"
#include "pictura/cli/map_options.h"
#include "pictura/cli/report.h"
#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/driving/world.h"
#include "pictura/map/load_map.h"

namespace pictura {

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

WorldOptions bench_world(int num_threads, float share, int parked_cars) {
  WorldOptions world;
  world.agents = 120;
  world.num_threads = num_threads;
  world.pedestrian_fraction = world.cyclist_fraction = share;
  world.parked_cars = parked_cars;
  return world;
}

std::string population_of(const WorldOptions& world) {
  const float pedestrians = *world.pedestrian_fraction, cyclists = *world.cyclist_fraction;
  std::string text = fmt::format("{} agents", world.agents);
  if (pedestrians > 0 || cyclists > 0) text += fmt::format(" ({} pedestrians, {} cyclists)", pedestrians, cyclists);
  if (*world.parked_cars > 0) text += fmt::format(", {} parked cars", *world.parked_cars);
  return text;
}

std::string population_of_crowds() {
  return fmt::format("{} to {} agents", kCrowds[0], kCrowds[std::size(kCrowds) - 1]);
}

void add_maps_option(CLI::App* command, std::vector<std::string>* maps, const std::string& default_maps) {
  add_map_list_option(
      command, maps,
      fmt::format("Maps, separated by commas, used in turn; towns: all towns of the map folder; default: {}",
                  default_maps));
}

std::vector<std::string> named_maps(const std::vector<std::string>& maps) {
  const std::vector<std::string> towns = known_towns();
  // The default is the town of the measurements in docs/.
  if (maps.empty()) return {std::binary_search(towns.begin(), towns.end(), "Town01") ? "Town01" : "procedural:1"};
  if (maps != std::vector<std::string>{"towns"}) return maps;
  PICTURA_CHECK(!towns.empty(), "--map towns: {} has none", map_folder());
  return towns;
}

void check_backends(const std::vector<std::string>& backends, const std::vector<std::string>& known) {
  for (const std::string& backend : backends) {
    if (std::find(known.begin(), known.end(), backend) != known.end()) continue;
    fail_usage("--backend: expected one of {}; got '{}'{}", fmt::join(known, ", "), backend,
               suggestion(backend, known));
  }
}

void BenchContext::add_gpu(const std::string& name, const std::string& driver_name) {
  if (name.empty()) return;
  device = name + "; " + device;
  driver = driver_name;
}

Json BenchContext::json() const {
  Json object{{"workload", workload}, {"backend", backend}, {"device", device}};
  if (!driver.empty()) object["driver"] = driver;
  object["commit"] = PICTURA_COMMIT;
  return object;
}

Json summary_of(BenchResult result) {
  std::sort(result.values.begin(), result.values.end());
  const size_t n = result.values.size();
  return {{"name", result.name},
          {"value", 0.5 * (result.values[(n - 1) / 2] + result.values[n / 2])},
          {"unit", result.unit},
          {"mean", std::accumulate(result.values.begin(), result.values.end(), 0.0) / static_cast<double>(n)},
          {"min", result.values.front()},
          {"max", result.values.back()},
          {"repeats", n}};
}

void print_heading(const BenchContext& context) {
  print_result("{}\nbackend {} on {}{}, commit {}\n", context.workload, context.backend, context.device,
               context.driver.empty() ? "" : ", driver " + context.driver, PICTURA_COMMIT);
}

void report_benchmark(bool json, const BenchContext& context, const std::vector<BenchResult>& results,
                      const std::optional<EarlierReport>& earlier) {
  Json object = context.json();
  object["results"] = Json::array();
  Json& rows = object["results"];
  for (const BenchResult& result : results) rows.push_back(summary_of(result));
  if (json) {
    if (earlier) earlier->add_comparison(&object);
    return print_json(object);
  }
  print_heading(context);
  for (const Json& row : rows) {
    print_result("{:50} {:>14.6g} {:18} (mean {:.6g}, min {:.6g}, max {:.6g}, {} repeats)\n",
                 row["name"].get<std::string>(), row["value"].get<double>(), row["unit"].get<std::string>(),
                 row["mean"].get<double>(), row["min"].get<double>(), row["max"].get<double>(),
                 row["repeats"].get<int>());
  }
  if (earlier) earlier->print_comparison(object);
}

void add_compare_option(CLI::App* command, std::optional<EarlierReport>* earlier) {
  command
      ->add_option_function<std::string>(
          "--compare", [earlier](const std::string& path) { earlier->emplace(path); },
          "Also print the ratios to an earlier result: a file with the output of --json")
      ->check(input_file());
}

void add_bench_command(CLI::App& app) {
#ifdef PICTURA_HAS_TORCH
  constexpr const char *kTrain = "bench train, ", *kBreakdown = "bench breakdown, ";
#else
  constexpr const char *kTrain = "", *kBreakdown = "";
#endif
  CLI::App* command = app.add_subcommand(
      "bench",
      fmt::format("Measure rates, quality and worlds: bench render, bench history, bench simulate, {}bench scenes, "
                  "{}bench quality, bench worlds, bench map, bench soak",
                  kTrain, kBreakdown));
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  pictura bench simulate --map Town01 --agents 120 --json\n  pictura bench render --size 192x108\n"
      "  pictura bench worlds --map procedural:1 --episodes 5");
#ifdef PICTURA_HAS_TORCH
  add_train_benchmark(*command);
#endif
  add_scenes_benchmark(*command);
#ifdef PICTURA_HAS_BENCH
  add_simulate_benchmark(*command);
  add_quality_benchmark(*command);
  add_render_benchmark(*command);
  add_worlds_benchmark(*command);
  add_map_benchmark(*command);
  add_soak_benchmark(*command);
  add_history_benchmark(*command);
#ifdef PICTURA_HAS_TORCH
  add_breakdown_benchmark(*command);
#endif
#endif
}

}  // namespace pictura
