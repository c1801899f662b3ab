// Code that the benchmarks of `pictura bench` share: options, results and reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/bench/commands/compare_results.h"
#include "pictura/cli/report.h"
#include "pictura/driving/world.h"

namespace pictura {

std::string processor_name();
/// Returns options for worlds of 120 agents. share: share of pedestrians, and of cyclists.
WorldOptions bench_world(int num_threads, float share, int parked_cars);
/// Numbers of agents of `--sweep crowd`.
constexpr int kCrowds[] = {256, 512, 1024, 2048, 4096};
/// `world` must set the fractions of all classes.
std::string population_of(const WorldOptions& world);
std::string population_of_crowds();

/// Adds --map. default_maps: text of the default in the help.
void add_maps_option(CLI::App* command, std::vector<std::string>* maps,
                     const std::string& default_maps = "Town01 where it is found, else procedural:1");
/// Returns the maps that --map selects. `towns` selects all maps of the map folder, which must not be empty. An empty
/// list selects the default.
std::vector<std::string> named_maps(const std::vector<std::string>& maps);

/// Throws UsageError unless each backend is known.
void check_backends(const std::vector<std::string>& backends, const std::vector<std::string>& known);

struct BenchContext {
  std::string workload, backend;
  std::string device = processor_name();
  std::string driver;

  /// Does nothing for an empty name.
  void add_gpu(const std::string& name, const std::string& driver_name);
  /// Includes the commit of this program.
  Json json() const;
};

struct BenchResult {
  std::string name, unit;
  std::vector<double> values;  // one per repeat
};

/// Returns name, median (value), unit, mean, min, max and number of repeats.
Json summary_of(BenchResult result);

void print_heading(const BenchContext& context);

/// Prints medians, means, minima and maxima, and a comparison with `earlier` if given.
void report_benchmark(bool json, const BenchContext& context, const std::vector<BenchResult>& results,
                      const std::optional<EarlierReport>& earlier = {});

/// Adds --compare. Parsing fails for a file that is not a report.
void add_compare_option(CLI::App* command, std::optional<EarlierReport>* earlier);

void add_bench_command(CLI::App& app);

/// Each adds a subcommand of `bench`.
void add_train_benchmark(CLI::App& bench);
void add_scenes_benchmark(CLI::App& bench);
void add_breakdown_benchmark(CLI::App& bench);
void add_simulate_benchmark(CLI::App& bench);
void add_quality_benchmark(CLI::App& bench);
void add_render_benchmark(CLI::App& bench);
void add_history_benchmark(CLI::App& bench);
void add_worlds_benchmark(CLI::App& bench);
void add_map_benchmark(CLI::App& bench);
void add_soak_benchmark(CLI::App& bench);

}  // namespace pictura
