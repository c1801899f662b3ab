// Figures from earlier results of benchmarks: of the JSON that they print, and of the files of scripts/gpu_check, which
// hold several of those.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/apps/draw_plot.h"

namespace pictura {

/// Files of results, and the PNG file that is drawn from them.
struct PlotArguments {
  std::vector<std::string> results;
  std::string figure;
};
/// Adds the options --plot and --figure.
void add_plot_options(CLI::App* command, PlotArguments* arguments);
/// Whether they were given; ends the program with wrong usage where only one of them was.
bool wants_plot(const PlotArguments& arguments);

struct PlottedResult {
  std::string name;
  double value = 0;
};
/// The results in the files, in their order. Throws Error naming the file that cannot be read or holds none.
std::vector<PlottedResult> read_results(const std::vector<std::string>& paths);

/// Adds a point to the series of that name, which begins with it if there is none; points of a series ascend in x, and
/// the first that is given for an x stays.
void add_point(PlotPanel* panel, const std::string& series, double x, double y);

}  // namespace pictura
