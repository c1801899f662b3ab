#include "pictura/bench/commands/plot_results.h"

#include <algorithm>

#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"

namespace pictura {

bool wants_plot(const PlotArguments& arguments) {
  if (arguments.results.empty() != arguments.figure.empty()) fail_usage("--plot and --figure: expected both");
  return !arguments.results.empty();
}

void add_repeat_options(CLI::App* command, RateArguments* arguments) {
  command->add_option("--repeats", arguments->repeats, "Measurements of each case; the median is printed")
      ->transform(whole_number(1))
      ->capture_default_str();
  command->add_option("--repeat-seconds", arguments->repeat_s, "Least length of a measurement, s")
      ->transform(number(1e-3, 3600))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object");
}

void add_rate_options(CLI::App* command, RateArguments* arguments) {
  add_repeat_options(command, arguments);
  command->add_option("--plot", arguments->plot.results, "Plot the sweeps of these results instead of measuring")
      ->delimiter(',');
  command->add_option("--figure", arguments->plot.figure, "PNG file for --plot");
}

std::vector<PlottedResult> read_results(const std::vector<std::string>& paths) {
  std::vector<PlottedResult> results;
  for (const std::string& path : paths) {
    const Json object = parse_json(read_file(path), /*allow_exceptions=*/false);
    const std::size_t before = results.size();
    auto add = [&](const Json& benchmark) {
      if (!benchmark.is_object() || !benchmark.contains("results")) return;
      for (const Json& row : benchmark["results"]) results.push_back({row.value("name", ""), row.value("value", 0.0)});
    };
    add(object);
    if (object.is_object() && object.contains("bench")) {
      for (const Json& benchmark : object["bench"]) add(benchmark);
    }
    PICTURA_CHECK(results.size() > before, "{}: expected results of a benchmark", path);
  }
  return results;
}

PlotPanel sweep_panel(const std::string& title, const std::string& x_label, const std::string& y_label) {
  return {title, x_label, y_label, {}, AxisScale::binary, AxisScale::decimal};
}

void add_point(PlotPanel* panel, const std::string& series, double x, double y) {
  auto& all = panel->series;
  auto found = std::find_if(all.begin(), all.end(), [&](const PlotSeries& s) { return s.name == series; });
  if (found == all.end()) found = all.insert(found, PlotSeries{series, {}, {}});
  const auto at = std::lower_bound(found->x.begin(), found->x.end(), x);
  if (at != found->x.end() && *at == x) return;
  found->y.insert(found->y.begin() + (at - found->x.begin()), y);
  found->x.insert(at, x);
}

}  // namespace pictura
