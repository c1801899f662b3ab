// Comparison of a measurement with an earlier result of the same benchmark: ratios of medians with the spread of their
// repeats, to detect regressions.
#pragma once

#include <string>
#include <vector>

#include "pictura/cli/report.h"

namespace pictura {

/// Comparison of a result with the earlier result of the same name.
enum class Change { better, worse, within_spread, undirected };

struct Comparison {
  std::string name, unit;
  double before = 0, after = 0;  // medians
  double ratio = 0;              // after / before
  double low = 0, high = 0;      // bounds of the ratio from the extremes of both: min / max, max / min
  Change change = Change::undirected;
};

/// Compares rows of `name`, `value`, `unit`, `min` and `max` of two reports, by name; rows of only one report are
/// omitted. Rates (units "..._per_s") are better when greater, times and memory (s, ms, GB, GiB) when smaller; other
/// units have no direction. A change counts if the ranges of both rows do not overlap.
std::vector<Comparison> compare_results(const Json& before_rows, const Json& after_rows);

/// An earlier report: output of `--json`.
class EarlierReport {
 public:
  /// Throws Error naming the file if it cannot be read or is not a benchmark report.
  explicit EarlierReport(const std::string& path);

  /// Adds "comparison" to a report: file, commit and device of the earlier report, whether workload and device are
  /// equal, and the ratios.
  void add_comparison(Json* report_inout) const;
  /// Prints the ratios for people, after a warning if the workload or the device differs.
  void print_comparison(const Json& report) const;

 private:
  std::string path_;
  Json report_;
};

}  // namespace pictura
