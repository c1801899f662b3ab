// Options of rate benchmarks, and charts of JSON reports and of files of scripts/gpu_check.
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
/// description: help text of --plot.
void add_plot_options(CLI::App* command, const std::string& description, PlotArguments* arguments);
/// Whether --plot and --figure were given. Throws UsageError if only one was given.
bool has_plot_arguments(const PlotArguments& arguments);
/// Draws with the Python module pictura.plot. request: further arguments of the chart's function.
void draw_results(const std::string& chart, const PlotArguments& arguments, Json request = Json::object());

struct RateArguments {
  int repeats = 7;
  double repeat_s = 1.0;  // approximate
  PlotArguments plot;
  bool json = false;
};
/// Adds --repeats, --repeat-seconds and --json.
void add_repeat_options(CLI::App* command, RateArguments* arguments);
/// Adds --repeats, --repeat-seconds, --json, --plot and --figure.
void add_rate_options(CLI::App* command, RateArguments* arguments);

}  // namespace pictura
