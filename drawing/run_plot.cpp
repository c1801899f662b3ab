#include "pictura/drawing/run_plot.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <sstream>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/toml_fields.h"
#include "pictura/drawing/progress_table.h"

namespace pictura {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Run {
  std::string folder;
  ProgressTable progress;
  std::string settings;  // config.toml but for run.seed; the folder where runs are not grouped
  int64_t seed = 0;
};

Run read_run(const std::string& folder, bool group_seeds) {
  Run run{folder, ProgressTable(folder), folder};
  PICTURA_CHECK(run.progress.num_rows() > 0, "{}: has no update yet", run.progress.path());
  if (!group_seeds) return run;
  const std::string path = folder + "/config.toml";
  PICTURA_CHECK(
      std::filesystem::exists(path),
      "{}: expected beside progress.csv, to find runs that differ in their seed alone; --group none needs none", path);
  toml::table config = parse_toml(read_file(path), path);
  toml::table* const section = config["run"].as_table();
  PICTURA_CHECK(section && (*section)["seed"].is_integer(), "{}: expected a number run.seed", path);
  run.seed = (*section)["seed"].value_or(int64_t{0});
  section->erase("seed");
  std::ostringstream text;
  text << config;
  run.settings = text.str();
  return run;
}

/// The column that a metric names in full, or by what follows its slash.
std::string column_of(const std::string& metric, const ProgressTable& progress) {
  std::vector<std::string> found;
  for (const std::string& name : progress.names()) {
    if (name == metric) return name;
    if (name.ends_with(fmt::format("/{}", metric))) found.push_back(name);
  }
  PICTURA_CHECK(found.size() < 2, "{}: '{}' may be {}", progress.path(), metric, fmt::join(found, " or "));
  return found.empty() ? metric : found[0];  // the table refuses one that it does not have
}

std::vector<double> hours_of(const ProgressTable& progress) {
  const std::vector<double>&rollout_s = progress.column("time/rollout_s"), &update_s = progress.column("time/update_s");
  std::vector<double> hours;
  double sum_s = 0;
  for (size_t i = 0; i < rollout_s.size(); ++i) hours.push_back((sum_s += rollout_s[i] + update_s[i]) / 3600);
  return hours;
}

/// The mean of what is finite in [begin, end) of a list; NaN where nothing is.
double mean_of_finite(const std::vector<double>& values, size_t begin, size_t end) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = begin; i < end; ++i) {
    if (std::isfinite(values[i])) sum += values[i], ++count;
  }
  return count == 0 ? kNan : sum / static_cast<double>(count);
}

/// A run's curve, in at most kMaxRunPoints points.
PlotSeries curve_of(const Run& run, RunAxis axis, const std::string& column) {
  const std::vector<double> x =
      axis == RunAxis::hours ? hours_of(run.progress) : run.progress.column("charts/agent_steps");
  const std::vector<double>& y = run.progress.column(column);
  const size_t stride = (x.size() + kMaxRunPoints - 1) / kMaxRunPoints;
  PlotSeries curve;
  for (size_t begin = 0; begin < x.size(); begin += stride) {
    const size_t end = std::min(begin + stride, x.size());
    curve.x.push_back(mean_of_finite(x, begin, end));
    curve.y.push_back(mean_of_finite(y, begin, end));
  }
  return curve;
}

/// A curve's height between its points; NaN beside one that is not finite.
double height_at(const PlotSeries& curve, double x) {
  const auto after = std::lower_bound(curve.x.begin(), curve.x.end(), x);
  const auto i = static_cast<size_t>(after - curve.x.begin());
  if (i == 0 || (i < curve.x.size() && curve.x[i] == x)) return curve.y[i];
  const double share = (x - curve.x[i - 1]) / (curve.x[i] - curve.x[i - 1]);
  return curve.y[i - 1] + share * (curve.y[i] - curve.y[i - 1]);
}

/// The mean of curves where all of them are, and a band from the lowest to the highest.
PlotSeries mean_of_curves(const std::vector<PlotSeries>& curves, const std::string& name) {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  size_t num_points = 0;
  for (const PlotSeries& curve : curves) {
    low = std::max(low, curve.x.front());
    high = std::min(high, curve.x.back());
    num_points = std::max(num_points, curve.x.size());
  }
  PICTURA_CHECK(low <= high, "{}: these runs have no stretch in common; --group none draws them apart", name);
  PlotSeries mean;
  for (size_t i = 0; i < num_points; ++i) {
    const double share = num_points == 1 ? 0 : static_cast<double>(i) / static_cast<double>(num_points - 1);
    // Not beyond the end by rounding.
    const double x = i + 1 == num_points ? high : low + share * (high - low);
    std::vector<double> heights;
    for (const PlotSeries& curve : curves) heights.push_back(height_at(curve, x));
    const bool in_all = std::all_of(heights.begin(), heights.end(), [](double y) { return std::isfinite(y); });
    mean.x.push_back(x);
    mean.y.push_back(in_all ? mean_of_finite(heights, 0, heights.size()) : kNan);
    mean.low.push_back(in_all ? *std::min_element(heights.begin(), heights.end()) : kNan);
    mean.high.push_back(in_all ? *std::max_element(heights.begin(), heights.end()) : kNan);
  }
  return mean;
}

/// The folders' own names; as they were given where two are alike.
std::vector<std::string> names_of(const std::vector<std::string>& folders) {
  std::vector<std::string> names;
  for (const std::string& folder : folders) {
    names.push_back(std::filesystem::canonical(folder).filename().string());
  }
  std::vector<std::string> sorted = names;
  std::sort(sorted.begin(), sorted.end());
  return std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end() ? names : folders;
}

/// "town_*, 3 seeds" of town_a, town_b and town_c.
std::string name_of_group(const std::vector<std::string>& names) {
  if (names.size() == 1) return names[0];
  std::string begin = names[0], end = names[0];
  for (const std::string& name : names) {
    const auto differs = std::mismatch(begin.begin(), begin.end(), name.begin(), name.end()).first;
    begin.erase(differs, begin.end());
    const auto differs_back = std::mismatch(end.rbegin(), end.rend(), name.rbegin(), name.rend()).first;
    end.erase(end.begin(), differs_back.base());
  }
  // Beginning and end do not overlap in the shortest name.
  for (const std::string& name : names) {
    if (begin.size() + end.size() > name.size()) end.erase(0, begin.size() + end.size() - name.size());
  }
  return fmt::format("{}*{}, {} seeds", begin, end, names.size());
}

/// Title and unit of a column: "driving/goals_per_1000_steps" is Goals per 1,000 agent-steps.
void set_labels(const std::string& column, PlotPanel* panel_out) {
  constexpr std::pair<std::string_view, const char*> kUnits[] = {{"_per_1000_steps", "per 1,000 agent-steps"},
                                                                 {"_per_km", "per km"},
                                                                 {"_mps", "m/s"},
                                                                 {"_per_step", "per agent-step"},
                                                                 {"_per_s", "per second"},
                                                                 {"_share", "share"},
                                                                 {"_fraction", "share"},
                                                                 {"_rate", ""},
                                                                 {"_s", "s"}};
  std::string title = column.substr(column.find('/') + 1);
  for (const auto& [suffix, unit] : kUnits) {
    if (!title.ends_with(suffix)) continue;
    panel_out->y_label = unit;
    if (*unit) title.erase(title.size() - suffix.size());
    break;
  }
  std::replace(title.begin(), title.end(), '_', ' ');
  title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  if (column.starts_with("rewards/")) title = fmt::format("Reward: {}", title);
  panel_out->title = title;
}

}  // namespace

RunPlot plot_runs(const std::vector<std::string>& folders, const RunPlotOptions& options) {
  PICTURA_CHECK(!folders.empty() && !options.metrics.empty(), "plot of runs: expected a run and a metric or more");
  std::vector<Run> runs;
  for (const std::string& folder : folders) {
    runs.push_back(read_run(folder, options.group_seeds));
    for (size_t i = 0; i + 1 < runs.size(); ++i) {
      PICTURA_CHECK(!std::filesystem::equivalent(folders[i], folder), "{}: is the same folder as {}", folder,
                    folders[i]);
    }
  }
  const std::vector<std::string> names = names_of(folders);

  RunPlot plot;
  std::vector<std::vector<size_t>> members;  // of each line, by run
  for (size_t i = 0; i < runs.size(); ++i) {
    const auto group = std::find_if(members.begin(), members.end(), [&](const std::vector<size_t>& other) {
      return runs[other[0]].settings == runs[i].settings;
    });
    if (group == members.end())
      members.push_back({i});
    else
      group->push_back(i);
  }
  for (const std::vector<size_t>& group : members) {
    RunLine line;
    std::vector<std::string> names_in_group;
    for (const size_t i : group) {
      names_in_group.push_back(names[i]);
      line.runs.push_back(folders[i]);
      if (options.group_seeds) line.seeds.push_back(runs[i].seed);
    }
    line.name = name_of_group(names_in_group);
    plot.lines.push_back(line);
  }
  for (const std::string& metric : options.metrics) {
    PlotPanel panel;
    panel.x_label = options.x == RunAxis::hours ? "hours" : "agent-steps";
    plot.columns.push_back(column_of(metric, runs[0].progress));
    set_labels(plot.columns.back(), &panel);
    for (size_t line = 0; line < members.size(); ++line) {
      std::vector<PlotSeries> curves;
      for (const size_t i : members[line]) curves.push_back(curve_of(runs[i], options.x, plot.columns.back()));
      panel.series.push_back(curves.size() == 1 ? curves[0] : mean_of_curves(curves, plot.lines[line].name));
      panel.series.back().name = plot.lines[line].name;
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

}  // namespace pictura
