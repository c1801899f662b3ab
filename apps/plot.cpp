// `pictura plot`: draws curves of training runs, of evaluations during training, or of evaluations by severity into one
// picture.
#include "pictura/apps/commands.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/draw_chart.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"

namespace pictura {

void add_plot_command(CLI::App& app) {
  struct Arguments {
    std::vector<std::string> runs;
    std::vector<std::string> metrics;
    std::string evaluations;
    std::vector<std::string> severities;
    std::string out = "plot.png", x = "agent_steps", group = "seeds";
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("plot", "Draw curves of training runs");
  command->add_option("RUN", arguments->runs, "Folders written by pictura train --out");
  CLI::Option* const evaluations =
      command
          ->add_option(
              "--evaluations", arguments->evaluations,
              "Instead of runs: a file of evaluations during training, which scripts/reproduce_table --curves wrote; "
              "draws five metrics of the protocol, with a line for medium density and a band over all densities")
          ->check(CLI::ExistingFile)
          ->check(input_file())
          ->excludes("RUN");
  CLI::Option* const severities =
      command
          ->add_option("--severities", arguments->severities,
                       "Instead of runs: outputs of evaluate --camera-severity --json; draws metrics of the protocol "
                       "by severity, with a line and its 95 % interval for each file and density")
          ->check(CLI::ExistingFile)
          ->check(input_file())
          ->excludes("RUN")
          ->excludes(evaluations);
  command->add_option("--out", arguments->out, "Picture to write: a PNG, or vector graphics as .svg")
      ->check(output_file({".png", ".svg"}))
      ->capture_default_str();
  command
      ->add_option(
          "--x", arguments->x,
          "Horizontal axis: agent-steps, or hours of rollouts and updates (for --evaluations: hours of one GPU)")
      ->check(one_of({"agent_steps", "hours"}).description("{agent_steps,hours}"))
      ->capture_default_str()
      ->excludes(severities);
  command
      ->add_option("--metrics", arguments->metrics,
                   "Columns of progress.csv, one panel each; the part after the slash suffices if it is unique; "
                   "default: return, goals, speed and three kinds of infractions")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->excludes(evaluations)
      ->excludes(severities);
  command
      ->add_option("--group", arguments->group,
                   "seeds: one line for all runs whose config.toml differ only in run.seed: their mean, with a band "
                   "from minimum to maximum; none: one line per run")
      ->check(one_of({"seeds", "none"}).description("{seeds,none}"))
      ->capture_default_str()
      ->excludes(evaluations)
      ->excludes(severities);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "docs/reference/run_folder.md lists the columns. With many updates, points are means of consecutive updates.\n"
      "The mean of several runs ends where the shortest run ends.\n"
      "--json prints the picture's path, the meaning of the band, and for each line its name, number of points and\n"
      "range of x; for runs also the metrics and their last values.\n"
      "Charts need Python 3.11 with Matplotlib; PICTURA_PYTHON is the path of the interpreter. If Python runs but\n"
      "lacks Matplotlib, it writes the data to OUT.json, and the status is 1.\n"
      "Examples:\n"
      "  pictura plot runs/a runs/b --out curves.png\n"
      "  pictura plot runs/town01_seed* --x hours --metrics episode_return,off_road_per_km\n"
      "  pictura plot runs/a --metrics rewards/goal_per_1000_steps,rewards/collision_per_1000_steps,entropy\n"
      "  pictura plot --evaluations out/table/curves.json --out curves.png\n"
      "  pictura plot --severities cameras.json --out cameras.png");
  command->callback([arguments] {
    if (arguments->runs.empty() && arguments->evaluations.empty() && arguments->severities.empty()) {
      fail_usage("pictura plot: expected RUN, --evaluations or --severities");
    }
    Json request{{"out", arguments->out}, {"report", arguments->json ? "json" : "text"}};
    if (!arguments->severities.empty()) {
      request["chart"] = "severity_curves";
      request["results"] = arguments->severities;
      return draw_chart(request);
    }
    request["x"] = arguments->x;
    if (arguments->evaluations.empty()) {
      request["chart"] = "run_curves";
      request["runs"] = arguments->runs;
      request["group"] = arguments->group;
      if (!arguments->metrics.empty()) request["metrics"] = arguments->metrics;
    } else {
      request["chart"] = "evaluation_curves";
      request["path"] = arguments->evaluations;
    }
    draw_chart(request);
  });
}

}  // namespace pictura
