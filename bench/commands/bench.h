// What the benchmarks of `pictura bench` share: results, and how they are reported.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/cli/drive.h"
#include "pictura/cli/report.h"

namespace pictura {

/// Name of the first processor.
std::string processor_name();
/// The agents of a world whose options say all of them, in words.
std::string population_of(const WorldOptions& world);

/// Adds the option --map, which takes several; the help says what the default is.
void add_maps_option(CLI::App* command, std::vector<std::string>* maps,
                     const std::string& default_maps = "Town01 where it is found, else procedural:1");
/// The maps that it means: `towns` is all of the map folder, which may not be empty then; nothing, the default one.
std::vector<std::string> named_maps(const std::vector<std::string>& maps);

/// Throws UsageError unless each of the option's backends is among those that this build knows.
void check_backends(const std::vector<std::string>& backends, const std::vector<std::string>& known);

/// What results were measured on.
struct BenchContext {
  std::string workload, backend;
  std::string device = processor_name();
  std::string driver;  // of a GPU

  /// Names a GPU and its driver beside the processor; nobody where there is none, whose name is empty.
  void add_gpu(const std::string& name, const std::string& driver_name);
  /// With the commit of this program.
  Json json() const;
};

struct BenchResult {
  std::string name, unit;
  std::vector<double> values;  // one per repeat
};

/// Prints medians and means with their least and greatest values.
void report_benchmark(bool json, const BenchContext& context, std::vector<BenchResult> results);

/// Adds the subcommand `bench`.
void add_bench_command(CLI::App& app);

/// Add `bench simulate`, `bench quality`, `bench render`, `bench worlds` and `bench soak`.
void add_simulate_benchmark(CLI::App& bench);
void add_quality_benchmark(CLI::App& bench);
void add_render_benchmark(CLI::App& bench);
void add_worlds_benchmark(CLI::App& bench);
void add_soak_benchmark(CLI::App& bench);

}  // namespace pictura
