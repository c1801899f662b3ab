// Shared parts of benchmarks of rates: options of measurement and report, and charts of earlier results. Charts read
// JSON output, and files of scripts/gpu_check, which contain several outputs.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/common/support/json.h"

namespace pictura {

/// Files of results, and the picture to draw.
struct PlotArguments {
  std::vector<std::string> results;
  std::string figure;
};
/// Adds the options --plot, which `description` documents, and --figure.
void add_plot_options(CLI::App* command, const std::string& description, PlotArguments* arguments);
/// Whether both options were given. Throws UsageError if only one was given.
bool has_plot_arguments(const PlotArguments& arguments);
/// Draws a chart of pictura.plot from the results; `request` has further arguments of its function.
void draw_results(const std::string& chart, const PlotArguments& arguments, Json request = Json::object());

struct RateArguments {
  int repeats = 7;
  double repeat_s = 1.0;  // approximate duration of a repeat
  PlotArguments plot;
  bool json = false;
};
/// Adds the options --repeats, --repeat-seconds and --json.
void add_repeat_options(CLI::App* command, RateArguments* arguments);
/// Adds the options of add_repeat_options(), --plot and --figure.
void add_rate_options(CLI::App* command, RateArguments* arguments);

}  // namespace pictura
