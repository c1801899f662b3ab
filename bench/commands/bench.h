// Shared parts of the benchmarks of `pictura bench`: results and their report.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/bench/commands/compare_results.h"
#include "pictura/cli/report.h"
#include "pictura/driving/world.h"

namespace pictura {

/// Name of the first processor.
std::string processor_name();
/// Returns options of worlds of 120 agents, with `share` as the share of pedestrians and as that of cyclists.
WorldOptions bench_world(int num_threads, float share, int parked_cars);
/// Numbers of agents in the single world of `--sweep crowd`.
constexpr int kCrowds[] = {256, 512, 1024, 2048, 4096};
/// Describes the agents of a world; its options must set all fractions.
std::string population_of(const WorldOptions& world);
/// Describes the agents of the worlds of `--sweep crowd`.
std::string population_of_crowds();

/// Adds the option --map, which takes several maps; default_maps describes the default in the help.
void add_maps_option(CLI::App* command, std::vector<std::string>* maps,
                     const std::string& default_maps = "Town01 where it is found, else procedural:1");
/// Returns the maps of --map: `towns` means all maps of the map folder, which must not be empty; no value means the
/// default.
std::vector<std::string> named_maps(const std::vector<std::string>& maps);

/// Throws UsageError unless each backend is known.
void check_backends(const std::vector<std::string>& backends, const std::vector<std::string>& known);

/// Workload and device of a measurement.
struct BenchContext {
  std::string workload, backend;
  std::string device = processor_name();
  std::string driver;  // driver of a GPU

  /// Adds a GPU and its driver to the device; does nothing for an empty name.
  void add_gpu(const std::string& name, const std::string& driver_name);
  /// Returns the context as JSON, with the commit of this program.
  Json json() const;
};

struct BenchResult {
  std::string name, unit;
  std::vector<double> values;  // one per repeat
};

/// Returns name, median (value), unit, mean, min, max and number of repeats.
Json summary_of(BenchResult result);

/// Prints workload, backend, device and commit for people.
void print_heading(const BenchContext& context);

/// Prints medians and means with minimum and maximum, and their comparison with an earlier report, if there is one.
void report_benchmark(bool json, const BenchContext& context, const std::vector<BenchResult>& results,
                      const std::optional<EarlierReport>& earlier = {});

/// Adds the option --compare, which reads the earlier report: a file that is not a report is refused before the
/// measurement.
void add_compare_option(CLI::App* command, std::optional<EarlierReport>* earlier);

/// Adds the subcommand `bench`.
void add_bench_command(CLI::App& app);

/// Add the subcommands `bench train`, `bench scenes`, `bench breakdown`, `bench simulate`, `bench quality`, `bench
/// render`, `bench history`, `bench worlds`, `bench map` and `bench soak`.
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
