#include "pictura/bench/commands/plot_results.h"

#include "pictura/cli/draw_chart.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/common/error.h"

namespace pictura {

void add_plot_options(CLI::App* command, const std::string& description, PlotArguments* arguments) {
  command->add_option("--plot", arguments->results, description)->delimiter(',')->check(input_file());
  command->add_option("--figure", arguments->figure, "Picture of --plot: a PNG or .svg")
      ->check(output_file({".png", ".svg"}));
}

bool has_plot_arguments(const PlotArguments& arguments) {
  if (arguments.results.empty() != arguments.figure.empty()) fail_usage("--plot and --figure: expected both");
  return !arguments.results.empty();
}

void draw_results(const std::string& chart, const PlotArguments& arguments, Json request) {
  request["chart"] = chart;
  request["results"] = arguments.results;
  request["out"] = arguments.figure;
  draw_chart(request);
}

void add_repeat_options(CLI::App* command, RateArguments* arguments) {
  add_number_option(command, "--repeats", arguments->repeats, "Measurements of each case; the median is printed", 1);
  add_number_option(command, "--repeat-seconds", arguments->repeat_s, "Minimum length of a measurement, s", 1e-3, 3600);
  command->add_flag("--json", arguments->json, "Print one JSON object");
}

void add_rate_options(CLI::App* command, RateArguments* arguments) {
  add_repeat_options(command, arguments);
  add_plot_options(command, "Plot the sweeps of these results instead of measuring", &arguments->plot);
}

}  // namespace pictura
