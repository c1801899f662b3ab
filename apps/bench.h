// What the benchmarks of `pictura bench` share: results, and how they are reported.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

struct BenchResult {
  std::string name, unit;
  std::vector<double> values;  // one per repeat
};

/// Prints medians with their least and greatest values.
void report_benchmark(bool json, const std::string& workload, const std::string& backend,
                      std::vector<BenchResult> results);

/// Adds `bench quality`.
void add_quality_benchmark(CLI::App& bench);

}  // namespace pictura
