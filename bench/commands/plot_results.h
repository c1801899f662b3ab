// Shared by benchmarks of rates: options of measurement and report, and figures from earlier results: from their JSON
// output, and from files of scripts/gpu_check, which contain several of those.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/drawing/plot.h"

namespace pictura {

/// Files of results, and the PNG file to draw.
struct PlotArguments {
  std::vector<std::string> results;
  std::string figure;
};
/// Whether both were given; throws UsageError if only one was.
bool wants_plot(const PlotArguments& arguments);

struct RateArguments {
  int repeats = 7;
  double repeat_s = 1.0;  // approximate duration of a repeat
  PlotArguments plot;
  bool json = false;
};
/// Adds the options --repeats, --repeat-seconds and --json.
void add_repeat_options(CLI::App* command, RateArguments* arguments);
/// Adds these and --plot and --figure.
void add_rate_options(CLI::App* command, RateArguments* arguments);

struct PlottedResult {
  std::string name;
  double value = 0;
};
/// The results in the files, in order. Throws Error naming a file that cannot be read or contains none.
std::vector<PlottedResult> read_results(const std::vector<std::string>& paths);

/// A panel of a sweep, with ticks at powers of 2 in x and at decades in y.
PlotPanel sweep_panel(const std::string& title, const std::string& x_label, const std::string& y_label);

/// Adds a point to the series of that name, which is created if missing; points of a series ascend in x, and of several
/// with one x the first is kept.
void add_point(PlotPanel* panel, const std::string& series, double x, double y);

}  // namespace pictura
