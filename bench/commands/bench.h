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

/// Product name of the first processor.
std::string processor_name();
/// Returns options for worlds of 120 agents. `share` is both the share of pedestrians and the share of cyclists.
WorldOptions bench_world(int num_threads, float share, int parked_cars);
/// Numbers of agents in the single world of `--sweep crowd`.
constexpr int kCrowds[] = {256, 512, 1024, 2048, 4096};
/// Describes the agents of a world. `world` must set the fractions of all classes.
std::string population_of(const WorldOptions& world);
/// Describes the agents of the worlds of `--sweep crowd`.
std::string population_of_crowds();

/// Adds the option --map, which accepts several maps. default_maps is the description of the default in the help.
void add_maps_option(CLI::App* command, std::vector<std::string>* maps,
                     const std::string& default_maps = "Town01 where it is found, else procedural:1");
/// Returns the maps that --map selects. `towns` selects all maps of the map folder, which must not be empty. An empty
/// list selects the default.
std::vector<std::string> named_maps(const std::vector<std::string>& maps);

/// Throws UsageError unless each backend is known.
void check_backends(const std::vector<std::string>& backends, const std::vector<std::string>& known);

/// Workload and device of a measurement.
struct BenchContext {
  std::string workload, backend;
  std::string device = processor_name();
  std::string driver;  // driver of a GPU

  /// Adds a GPU to `device`, and sets its driver. Does nothing for an empty name.
  void add_gpu(const std::string& name, const std::string& driver_name);
  /// Returns the context as JSON, including the commit of this program.
  Json json() const;
};

struct BenchResult {
  std::string name, unit;
  std::vector<double> values;  // one per repeat
};

/// Returns name, median (value), unit, mean, min, max and number of repeats.
Json summary_of(BenchResult result);

/// Prints workload, backend, device and commit as text.
void print_heading(const BenchContext& context);

/// Prints medians and means with minimum and maximum, as JSON or text. If an earlier report is given, also prints the
/// comparison with it.
void report_benchmark(bool json, const BenchContext& context, const std::vector<BenchResult>& results,
                      const std::optional<EarlierReport>& earlier = {});

/// Adds the option --compare, which reads the earlier report. Parsing the option fails for a file that is not a report,
/// so the error comes before the measurement.
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
