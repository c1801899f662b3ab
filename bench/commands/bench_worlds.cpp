// `pictura bench worlds`: measures distributions over many episodes on each map: agents by class, refusals by reason,
// unreachable goals, infractions of a random policy, and results of the lane keeper.
#include <fmt/format.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/bench/world_statistics.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

namespace {

struct WorldsArguments {
  std::vector<std::string> maps;
  WorldStatisticsOptions options;
  bool json = false;
};

void run_worlds(WorldsArguments arguments) {
  if (arguments.maps.empty()) arguments.maps = known_towns();
  arguments.maps = named_maps(arguments.maps);
  ProgressLine progress;
  std::vector<BenchResult> results;
  for (size_t i = 0; i < arguments.maps.size(); ++i) {
    arguments.options.on_progress = [&](const std::string& phase) {
      progress.update(fmt::format("{}: {}", arguments.maps[i], phase),
                      static_cast<double>(i) / static_cast<double>(arguments.maps.size()));
    };
    for (EpisodeValues& quantity : measure_worlds(load_map(arguments.maps[i]), arguments.options)) {
      results.push_back(
          {fmt::format("{}: {}", arguments.maps[i], quantity.name), quantity.unit, std::move(quantity.values)});
    }
  }
  progress.finish();
  report_benchmark(arguments.json,
                   {.workload = fmt::format("worlds: {} episodes of each map, {} requested agents; one lane keeper "
                                            "among parked cars, for 1,280 steps",
                                            arguments.options.episodes, arguments.options.agents),
                    .backend = "cpu"},
                   results);
}

}  // namespace

void add_worlds_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<WorldsArguments>();
  CLI::App* command = bench.add_subcommand("worlds", "Distributions over many episodes: agents and their events");
  add_maps_option(command, &arguments->maps, "all towns of the map folder, else procedural:1");
  add_number_option(command, "--episodes", arguments->options.episodes, "Episodes on each map", 1, 10'000);
  add_number_option(command, "--agents", arguments->options.agents, "Requested agents per world", 1,
                    kMaxAgentsPerWorld);
  add_seed_option(command, &arguments->options.seed, "Seed of the worlds");
  add_threads_option(command, &arguments->options.num_threads);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura bench worlds --map Town03 --episodes 100 --json\n"
      "  pictura bench worlds --map procedural:1 --episodes 5\n"
      "  pictura bench worlds --map towns --agents 60");
  command->callback([arguments] { run_worlds(*arguments); });
}

}  // namespace pictura
