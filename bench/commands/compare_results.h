// Comparison of a measurement with an earlier result, to detect regressions.
#pragma once

#include <string>
#include <vector>

#include "pictura/cli/report.h"

namespace pictura {

/// undirected: the unit has no better direction.
enum class Change { better, worse, within_spread, undirected };

struct Comparison {
  std::string name, unit;
  double before = 0, after = 0;  // medians
  double ratio = 0;              // after / before
  double low = 0, high = 0;      // bounds of the ratio: min(after) / max(before), max(after) / min(before)
  Change change = Change::undirected;
};

/// Compares rows of equal `name` and `unit`, with the keys `value`, `min` and `max`. Rates (units "..._per_s") are
/// better if greater; times and memory (s, ms, GB, GiB) are better if smaller. A row is better or worse only if the
/// ranges from min to max do not overlap.
std::vector<Comparison> compare_results(const Json& before_rows, const Json& after_rows);

/// A report that a benchmark printed with --json.
class EarlierReport {
 public:
  /// Throws Error naming the file if it cannot be read or is not a benchmark report.
  explicit EarlierReport(const std::string& path);

  /// Adds the key "comparison" to a report: file, commit and device of the earlier report, whether workload and device
  /// are equal, and the ratios.
  void add_comparison(Json* report_inout) const;
  /// Prints the ratios as text, after a warning if the workload or the device differs.
  void print_comparison(const Json& report) const;

 private:
  std::string path_;
  Json report_;
};

}  // namespace pictura
