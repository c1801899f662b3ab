// What benchmarks of rates share: the options of how they are measured and reported, and figures from earlier results:
// of the JSON that they print, and of the files of scripts/gpu_check, which hold several of those.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/drawing/plot.h"

namespace pictura {

/// Files of results, and the PNG file that is drawn from them.
struct PlotArguments {
  std::vector<std::string> results;
  std::string figure;
};
/// Whether they were given; throws UsageError where only one of them was.
bool wants_plot(const PlotArguments& arguments);

struct RateArguments {
  int repeats = 7;
  double repeat_s = 1.0;  // of each repeat, about
  PlotArguments plot;
  bool json = false;
};
/// Adds the options --repeats, --repeat-seconds, --plot, --figure and --json.
void add_rate_options(CLI::App* command, RateArguments* arguments);

struct PlottedResult {
  std::string name;
  double value = 0;
};
/// The results in the files, in their order. Throws Error naming the file that cannot be read or holds none.
std::vector<PlottedResult> read_results(const std::vector<std::string>& paths);

/// A panel of a sweep, whose x doubles and whose y spans decades.
PlotPanel sweep_panel(const std::string& title, const std::string& x_label, const std::string& y_label);

/// Adds a point to the series of that name, which begins with it if there is none; points of a series ascend in x, and
/// the first that is given for an x stays.
void add_point(PlotPanel* panel, const std::string& series, double x, double y);

}  // namespace pictura
