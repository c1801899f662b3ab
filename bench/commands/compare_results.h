// Compares a measurement with an earlier result of the same benchmark: ratios of medians with the spread of their
// repeats, so that a regression is seen in one command.
#pragma once

#include <string>
#include <vector>

#include "pictura/cli/report.h"

namespace pictura {

/// How a result stands to the earlier one of its name.
enum class Change { better, worse, within_spread, undirected };

struct Comparison {
  std::string name, unit;
  double before = 0, after = 0;  // medians
  double ratio = 0;              // after / before
  double low = 0, high = 0;      // of the ratio, by the extremes of both: min / max, max / min
  Change change = Change::undirected;
};

/// Compares rows of `name`, `value`, `unit`, `min` and `max` of two reports, by name; those that only one has are left
/// out. Rates (units "..._per_s") are better when they are greater, times and memory (s, ms, GB, GiB) when they are
/// smaller; other units have no better. A change counts when the ranges of both do not overlap.
std::vector<Comparison> compare_results(const Json& before_rows, const Json& after_rows);

/// An earlier report: what `--json` printed.
class EarlierReport {
 public:
  /// Throws Error naming the file if it cannot be read or is no report of a benchmark.
  explicit EarlierReport(const std::string& path);

  /// Adds "comparison" to a report: file, commit and device of the earlier, whether workload and device are equal, and
  /// the ratios.
  void add_comparison(Json* report_inout) const;
  /// Prints the ratios for people, beneath a warning if the workload or the device differs.
  void print_comparison(const Json& report) const;

 private:
  std::string path_;
  Json report_;
};

}  // namespace pictura
