// `pictura probe`: measures the responses of policies to road users that their cameras see, and to road users that they
// do not see.
#include <algorithm>
#include <array>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/apps/commands.h"
#include "pictura/apps/corner_figure.h"
#include "pictura/apps/pedestrian_figure.h"
#include "pictura/cli/case_replay_options.h"
#include "pictura/cli/draw_chart.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/option_flags.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/json.h"
#include "pictura/driving/replay_cases.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/pedestrian.h"
#include "pictura/evaluation/probes/removal.h"

namespace pictura {

namespace {

constexpr std::array<const char*, 3> kRemovalExamples{
    "pictura probe removal agent.safetensors vector.safetensors --out removal",
    "pictura probe removal runs/a/checkpoint.ckpt --map Town01 --scenes 2 --removals 2000 --steps 300 --replay "
    "case.html",
    "pictura probe removal agent.safetensors --map procedural:1 --agents 40 --removals 1000 --control unchanged"};
constexpr std::array<const char*, 3> kPedestrianExamples{
    "pictura probe pedestrian agent.safetensors vector.safetensors --out pedestrian",
    "pictura probe pedestrian runs/a/checkpoint.ckpt --map Town01 --scenes 2 --paths 4 --steps 300",
    "pictura probe pedestrian agent.safetensors --map procedural:1 --agents 40 --paths 8 --control unchanged"};
constexpr std::array<const char*, 3> kCornerExamples{
    "pictura probe corner agent.safetensors vector.safetensors --out corner",
    "pictura probe corner runs/a/checkpoint.ckpt --map Town05 --scenes 2 --pairs 20 --driver lane",
    "pictura probe corner agent.safetensors --map procedural:1,procedural:2 --density light --pairs 10 --min-speed 1"};

constexpr const char* kCaseOfReplay =
    "Number in cases.csv of the case for --replay; default: the case in which the first policy's value changes most";

std::string footer(const std::array<const char*, 3>& examples) {
  return fmt::format(
      "docs/explanation/probes.md explains the method, and docs/how-to/probe.md explains the files.\n"
      "Examples:\n  {}",
      fmt::join(examples, "\n  "));
}

template <typename Probe>
struct ProbeArguments {
  Probe probe;
  CaseReplayOptions replay;
  std::string out;
  bool json = false;
};

/// Adds all options of a probe. `files` names the files that the probe writes.
template <typename Probe>
void add_options(CLI::App* command, ProbeArguments<Probe>* arguments, const std::string& case_help,
                 const std::string& files, const std::array<const char*, 3>& examples) {
  Probe& probe = arguments->probe;
  command
      ->add_option("POLICY", probe.policies,
                   "Checkpoints written by train, or safetensors; the world is that of the first policy's training")
      ->check(input_file())
      ->required();
  add_evaluation_options(command, &probe.worlds);
  visit_options(probe, FlagAdder(command));
  add_case_replay_options(command, &arguments->replay, case_help);
  arguments->out = "probe_" + command->get_name();
  command->add_option("--out", arguments->out, "Folder for " + files)->capture_default_str();
  command->add_flag("--json", arguments->json, "Print the JSON object of summary.json");
  command->footer(footer(examples));
}

// Creates the folder for a probe's files, and runs the probe with a progress line.
template <typename Results, typename Probe>
Results run_probe(Results (*ask)(const Probe&), ProbeArguments<Probe>* arguments) {
  const OutputFolder folder(arguments->out);
  ProgressLine line;
  arguments->probe.worlds.on_progress = [&line](double done, double eta_s) {
    line.update(fmt::format("probing: {:.0f} %  ETA {}", 100 * done, format_duration(eta_s)));
  };
  Results results = ask(arguments->probe);
  line.finish();
  return results;
}

/// Returns the text of an estimate with one digit more than in evaluations, because changes of values are small.
std::string interval_of(const Estimate& estimate) { return interval_text(estimate, 4); }

size_t name_width(const ProbeResults& results) {
  size_t width = 6;
  for (const ProbedPolicy& policy : results.policies) width = std::max(width, policy.responding_name().size());
  return width;
}

constexpr const char* kEstimateNote =
    "means over scenes of the means of their cases; +- is the half width of a 95 % confidence interval over scenes";

void print_table(const RemovalResults& results, const std::vector<RemovalRow>& rows) {
  const size_t width = name_width(results);
  print_result("{:{}} {:>10} {:>8} {:>7} {:>20} {:>20} {:>8}\n", "policy", width, "occlusion", "cases", "scenes",
               "|dV|", "|dP(brake)|", "changed");
  for (const RemovalRow& row : rows) {
    if (row.group.distance_band || row.cases == 0) continue;
    print_result("{:{}} {:>10} {:>8} {:>7} {:>20} {:>20} {:>6.1f} %\n", results.policies[row.policy].responding_name(),
                 width, row.group.occlusion_name(), row.cases, row.scenes, interval_of(row.abs_value_change),
                 interval_of(row.abs_brake_change), 100 * row.changed_share.value);
  }
  print_result("{}\n{} removals in {}\n", kEstimateNote, results.cases.size(), format_duration(results.seconds));
}

void print_table(const PedestrianResults& results, const std::vector<PedestrianRow>& rows) {
  const size_t width = name_width(results);
  print_result("{:{}} {:>12} {:>8} {:>7} {:>20} {:>20} {:>8}\n", "policy", width, "pedestrian", "cases", "scenes", "dV",
               "dP(brake)", "changed");
  for (const PedestrianRow& row : rows) {
    if (!row.phase || row.cases == 0) continue;
    print_result("{:{}} {:>12} {:>8} {:>7} {:>20} {:>20} {:>6.1f} %\n", results.policies[row.policy].responding_name(),
                 width, kPathPhaseNames[static_cast<size_t>(*row.phase)], row.cases, row.scenes,
                 interval_of(row.value_change), interval_of(row.brake_change), 100 * row.changed_share.value);
  }
  print_result("{}\n{} of {} paths found, {} cases in {}\n", kEstimateNote, results.paths.size(), results.paths_asked,
               results.points.size(), format_duration(results.seconds));
}

void print_table(const CornerResults& results, const std::vector<CornerRow>& rows) {
  const size_t width = name_width(results);
  print_result("{:{}} {:>8} {:>6} {:>9} {:>11} {:>20} {:>20} {:>20}\n", "policy", width, "case", "walls", "revealed",
               "after (s)", "distance (m)", "speed (m/s)", "deceleration");
  for (const CornerRow& row : rows) {
    if (row.less_policy || row.less_case || row.revealed == 0) continue;
    print_result("{:{}} {:>8} {:>6} {:>9} {:>5.1f}-{:>5.1f} {:>20} {:>20} {:>20}\n",
                 results.policies[row.policy].responding_name(), width,
                 kCornerCaseNames[static_cast<size_t>(row.its_case)], kWallNames[row.walls ? 0 : 1], row.revealed,
                 row.reveal_s.front(), row.reveal_s.back(), interval_of(row.at_reveal.distance_m),
                 interval_of(row.at_reveal.speed_mps), interval_of(row.at_reveal.deceleration_mps2));
  }
  print_result(
      "at the reveal, where line of sight past the walls opens; deceleration over the next 2 s, m/s2\n{}\n"
      "{} of {} pairs, of {} states with a hidden vehicle and {} empty states, in {}\n",
      kEstimateNote, results.pairs.size(), results.pairs_asked, results.hidden_found, results.empty_found,
      format_duration(results.seconds));
}

/// Draws the chart of a probe's means as file `name`, and charts for `pages`. Without Matplotlib, prints a notice
/// instead.
void draw_charts(const std::string& name, const Json& pages, FilledFolder* out) {
  const std::string chart = out->file(name);
  try {
    draw_chart({{"chart", "probe_charts"}, {"folder", out->path()}, {"pages", pages}});
  } catch (const NoMatplotlib& error) {
    std::filesystem::remove(chart);  // removes the chart of an earlier call
    print_message("notice: {}\n", error.what());
  }
}

/// Writes summary.json, draws charts if `pages` is not null, and prints the summary or a table.
template <typename Probe, typename Results, typename Row>
void report(const ProbeArguments<Probe>& arguments, const std::string& summary, const Results& results,
            const std::vector<Row>& rows, const Json& pages, FilledFolder* out) {
  write_file(out->file("summary.json"), summary + "\n");
  const Json object = parse_json(summary);
  if (!pages.is_null()) draw_charts(object.at("kind").get<std::string>() + ".png", pages, out);
  out->remove_others();
  if (arguments.json)
    print_json(object);
  else
    print_table(results, rows);
}

void add_removal_command(CLI::App& probe) {
  auto arguments = std::make_shared<ProbeArguments<RemovalOptions>>();
  CLI::App* command = probe.add_subcommand(
      "removal", "Measure how value and braking change when one road user is removed, by its occlusion");
  add_options(command, arguments.get(), kCaseOfReplay, "cases.csv, summary.json and removal.png", kRemovalExamples);
  command->callback([arguments] {
    check_case_number(arguments->replay, arguments->probe.removals);
    const RemovalResults results = run_probe(&probe_removal, arguments.get());
    const std::vector<RemovalRow> rows = summarize(results);
    FilledFolder out(arguments->out, "probe");
    const std::string cases_file = out.file("cases.csv");
    write_removal_cases(cases_file, results);
    report(*arguments, removal_summary_json(results, rows, cases_file), results, rows, Json::array(), &out);
    if (results.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} removals are completed and written to {}",
                                    results.cases.size(), results.removals_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, arguments->probe, results);
  });
}

void add_pedestrian_command(CLI::App& probe) {
  auto arguments = std::make_shared<ProbeArguments<PedestrianOptions>>();
  CLI::App* command = probe.add_subcommand(
      "pedestrian",
      "Measure how value and braking change as a pedestrian emerges from behind a vehicle and is hidden again");
  add_options(command, arguments.get(), kCaseOfReplay,
              "cases.csv, summary.json, pedestrian.png and path_000.png, path_001.png, ...", kPedestrianExamples);
  command->callback([arguments] {
    const PedestrianResults results = run_probe(&probe_pedestrian, arguments.get());
    const std::vector<PedestrianRow> rows = summarize(results);
    FilledFolder out(arguments->out, "probe");
    const std::string cases_file = out.file("cases.csv");
    write_pedestrian_cases(cases_file, results);
    Json pages;
    if (!results.interrupted) {
      ProgressLine line;
      const size_t all = results.paths.size();
      pages = draw_pedestrian_paths(results, &out, [&](size_t done) {
        line.update(fmt::format("drawing: path {} of {}", done, all),
                    static_cast<double>(done) / static_cast<double>(all));
      });
      line.finish();
    }
    report(*arguments, pedestrian_summary_json(results, rows, cases_file), results, rows, pages, &out);
    if (results.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} paths are completed and written to {} without figures",
                                    results.paths.size(), results.paths_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, arguments->probe, results);
  });
}

void add_corner_command(CLI::App& probe) {
  auto arguments = std::make_shared<ProbeArguments<CornerOptions>>();
  CLI::App* command = probe.add_subcommand(
      "corner", "Measure how policies approach blind corners with a hidden vehicle, and similar empty corners");
  add_options(command, arguments.get(),
              "Number in cases.csv of the pair for --replay; default: the pair in example.png",
              "cases.csv, summary.json, corner.png and example.png", kCornerExamples);
  command->callback([arguments] {
    check_case_number(arguments->replay, arguments->probe.pairs);
    const CornerResults results = run_probe(&probe_corner, arguments.get());
    const std::vector<CornerRow> rows = summarize(results);
    FilledFolder out(arguments->out, "probe");
    const std::string cases_file = out.file("cases.csv");
    write_corner_cases(cases_file, results);
    Json pages;
    if (!results.pairs.empty()) {
      draw_corner_example(results, out.file("example.png"));
      pages = {{{"picture", "example.png"}, {"pair", example_of(results)}}};
    }
    report(*arguments, corner_summary_json(results, rows, cases_file), results, rows, pages, &out);
    if (results.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} pairs are completed and written to {}", results.pairs.size(),
                                    results.pairs_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, arguments->probe, results);
  });
}

}  // namespace

void add_probe_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("probe", "Measure policies' responses to road users: removal, pedestrian, corner");
  command->require_subcommand(1);
  command->footer(footer({kRemovalExamples[0], kPedestrianExamples[0], kCornerExamples[0]}));
  add_removal_command(*command);
  add_pedestrian_command(*command);
  add_corner_command(*command);
}

}  // namespace pictura
