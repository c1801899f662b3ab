// `pictura plot`: curves of training runs, or of evaluations along trainings, as one picture.
#include <cmath>

#include "pictura/apps/commands.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/report.h"
#include "pictura/drawing/evaluation_plot.h"
#include "pictura/drawing/run_plot.h"

namespace pictura {

namespace {

void add_extent(const PlotSeries& series, Json* line_inout) {
  (*line_inout)["points"] = series.x.size();
  (*line_inout)["x_first"] = series.x.front();
  (*line_inout)["x_last"] = series.x.back();
}

Json facts_of(const RunPlot& plot, const std::string& picture, const std::string& x) {
  Json lines = Json::array();
  for (size_t i = 0; i < plot.lines.size(); ++i) {
    Json last;
    for (size_t panel = 0; panel < plot.panels.size(); ++panel) {
      last[plot.columns[panel]] = finite_or_null(plot.panels[panel].series[i].y.back());
    }
    Json line{{"name", plot.lines[i].name}, {"runs", plot.lines[i].runs}, {"seeds", plot.lines[i].seeds}};
    add_extent(plot.panels[0].series[i], &line);
    line["last"] = last;
    lines.push_back(line);
  }
  return {{"out", picture}, {"x", x}, {"metrics", plot.columns}, {"band", "lowest to highest seed"}, {"lines", lines}};
}

Json facts_of(const std::vector<PlotPanel>& panels, const std::string& picture, const std::string& x) {
  Json lines = Json::array();
  for (const PlotSeries& series : panels[0].series) {
    Json line{{"name", series.name}};
    add_extent(series, &line);
    lines.push_back(line);
  }
  return {{"out", picture}, {"x", x}, {"band", "lowest to highest density"}, {"lines", lines}};
}

void draw(const std::vector<PlotPanel>& panels, const std::string& path) {
  const int columns = panels.size() == 4 ? 2 : 3;
  draw_plots_png(panels, path, {.panel_width_px = 480, .panel_height_px = 320, .columns = columns, .one_legend = true});
}

}  // namespace

void add_plot_command(CLI::App& app) {
  struct Arguments {
    std::vector<std::string> runs;
    std::string evaluations;
    RunPlotOptions plot;
    std::string out = "plot.png", x = "agent_steps", group = "seeds";
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("plot", "Draw curves of training runs");
  command->add_option("RUN", arguments->runs, "Folders that pictura train wrote (--out)");
  CLI::Option* const evaluations =
      command
          ->add_option("--evaluations", arguments->evaluations,
                       "Instead of runs: a file of evaluations along trainings, as scripts/reproduce_table --curves "
                       "writes it; five metrics of the protocol, a line at medium density in a band of all")
          ->check(CLI::ExistingFile)
          ->excludes("RUN");
  command->add_option("--out", arguments->out, "The PNG file to write")
      ->check(file_ending(".png"))
      ->capture_default_str();
  command
      ->add_option("--x", arguments->x,
                   "Over agent-steps, or hours of collecting and improving (of evaluations: of one GPU)")
      ->check(one_of({"agent_steps", "hours"}).description("{agent_steps,hours}"))
      ->capture_default_str();
  command
      ->add_option("--metrics", arguments->plot.metrics,
                   "Columns of progress.csv, a panel each; what follows the slash is enough where one column has it")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str()
      ->excludes(evaluations);
  command
      ->add_option(
          "--group", arguments->group,
          "seeds: runs whose config.toml differ in run.seed alone are one line, their mean, with a band from the "
          "lowest to the highest; none: a line each")
      ->check(one_of({"seeds", "none"}).description("{seeds,none}"))
      ->capture_default_str()
      ->excludes(evaluations);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "docs/training.md says what the columns are. Of many updates, points are means of consecutive ones. A mean ends\n"
      "where the first of its runs does.\n"
      "Examples:\n"
      "  pictura plot runs/a runs/b --out curves.png\n"
      "  pictura plot runs/town01_seed* --x hours --metrics episode_return,off_road_per_km\n"
      "  pictura plot runs/a --metrics rewards/goal_per_1000_steps,rewards/collision_per_1000_steps,entropy\n"
      "  pictura plot --evaluations out/table/curves.json --out curves.png");
  command->callback([arguments] {
    arguments->plot.x = arguments->x == "hours" ? RunAxis::hours : RunAxis::agent_steps;
    if (!arguments->evaluations.empty()) {
      const std::vector<PlotPanel> panels = plot_evaluations(arguments->evaluations, arguments->plot.x);
      draw(panels, arguments->out);
      if (arguments->json) {
        print_json(facts_of(panels, arguments->out, arguments->x));
      } else {
        print_result("{}: lines {}, panels {}\n", arguments->out, panels[0].series.size(), panels.size());
      }
      return;
    }
    if (arguments->runs.empty()) fail_usage("pictura plot: expected RUN or --evaluations");
    arguments->plot.group_seeds = arguments->group == "seeds";
    const RunPlot plot = plot_runs(arguments->runs, arguments->plot);
    draw(plot.panels, arguments->out);
    if (arguments->json) {
      print_json(facts_of(plot, arguments->out, arguments->x));
    } else {
      print_result("{}: runs {}, lines {}, panels {}\n", arguments->out, arguments->runs.size(), plot.lines.size(),
                   plot.panels.size());
    }
  });
}

}  // namespace pictura
