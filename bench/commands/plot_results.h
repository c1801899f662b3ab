// Code that benchmarks of rates share: options of measurements and reports, and charts of earlier results. Charts read
// the JSON output of benchmarks, and files of scripts/gpu_check, which contain several such outputs.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/common/support/json.h"

namespace pictura {

/// Arguments of --plot (files of results) and --figure (the picture to draw).
struct PlotArguments {
  std::vector<std::string> results;
  std::string figure;
};
/// Adds the options --plot and --figure. `description` is the help text of --plot.
void add_plot_options(CLI::App* command, const std::string& description, PlotArguments* arguments);
/// Whether --plot and --figure were given. Throws UsageError if only one of them was given.
bool has_plot_arguments(const PlotArguments& arguments);
/// Draws a chart from the results with the Python module pictura.plot. `request` contains further arguments of the
/// chart's function.
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
