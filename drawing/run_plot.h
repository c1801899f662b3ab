// Curves of several training runs: a panel a metric, a line a run, runs of several seeds as a mean with a band.
#pragma once

#include <string>
#include <vector>

#include "pictura/drawing/plot.h"

namespace pictura {

enum class RunAxis { agent_steps, hours };

struct RunPlotOptions {
  /// Columns of progress.csv, or what follows their slash where only one column has it.
  std::vector<std::string> metrics{"charts/episode_return",           "driving/goals_per_1000_steps",
                                   "driving/mean_speed_mps",          "driving/at_fault_collisions_per_1000_steps",
                                   "driving/off_road_per_1000_steps", "driving/red_light_per_1000_steps"};
  RunAxis x = RunAxis::agent_steps;
  bool group_seeds = true;  // runs whose config.toml differ in run.seed alone are one line
};

/// What a line shows.
struct RunLine {
  std::string name;
  std::vector<std::string> runs;
  std::vector<int64_t> seeds;  // of each run; empty where runs are not grouped
};

struct RunPlot {
  std::vector<std::string> columns;  // of each panel
  std::vector<PlotPanel> panels;
  std::vector<RunLine> lines;  // in the order of each panel's series
};

/// Reads the folders of runs. Hours are those of collecting and improving. A line has at most kMaxRunPoints points,
/// each the mean of as many consecutive updates; where it is of several runs it is their mean over the stretch that all
/// of them cover, and its band reaches from the lowest of them to the highest. Throws Error naming the folder, file or
/// column that is missing, or runs that no stretch has in common.
RunPlot plot_runs(const std::vector<std::string>& runs, const RunPlotOptions& options);
constexpr size_t kMaxRunPoints = 200;

}  // namespace pictura
