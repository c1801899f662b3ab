// `pictura probe`: what policies make of what their cameras see, and of what they do not.
#include <algorithm>
#include <array>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/apps/commands.h"
#include "pictura/apps/corner_figure.h"
#include "pictura/apps/pedestrian_figure.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/case_replay_options.h"
#include "pictura/cli/draw_chart.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/number_options.h"
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
    "pictura probe removal agent.safetensors --map procedural:1 --agents 40 --removals 1000 --control nobody"};
constexpr std::array<const char*, 3> kPedestrianExamples{
    "pictura probe pedestrian agent.safetensors vector.safetensors --out pedestrian",
    "pictura probe pedestrian runs/a/checkpoint.ckpt --map Town01 --scenes 2 --paths 4 --steps 300",
    "pictura probe pedestrian agent.safetensors --map procedural:1 --agents 40 --paths 8 --control nobody"};
constexpr std::array<const char*, 3> kCornerExamples{
    "pictura probe corner agent.safetensors vector.safetensors --out corner",
    "pictura probe corner runs/a/checkpoint.ckpt --map Town05 --scenes 2 --pairs 20 --driver lane",
    "pictura probe corner agent.safetensors --map procedural:1,procedural:2 --density light --pairs 10 --min-speed 1"};

constexpr const char* kCaseOfReplay =
    "The case of --replay, as numbered in cases.csv; default: where the first policy's value changes most";

std::string footer(const std::array<const char*, 3>& examples) {
  return fmt::format(
      "docs/probes.md says what is asked, how, and what the files hold.\n"
      "Examples:\n  {}",
      fmt::join(examples, "\n  "));
}

// What all probes are given.
struct ProbeArguments {
  EvaluateOptions evaluation;
  std::string density = "medium", out;
  int scenes = 0;  // 0: not given
  bool json = false;
};

// The policies, and options that come first in the help.
void add_world_options(CLI::App* command, ProbeArguments* arguments, ProbeOptions* probe) {
  EvaluateOptions& worlds = arguments->evaluation;
  worlds.steps = kProbeSteps;
  command
      ->add_option("POLICY", probe->policies, "Checkpoints that train wrote, or safetensors; the world is the first's")
      ->required();
  add_evaluation_options(command, &arguments->evaluation);
  command->add_option("--density", arguments->density, "light, medium or dense: 60, 120 or 150 agents a world")
      ->check(one_of({kDensityNames.begin(), kDensityNames.end()}))
      ->capture_default_str();
  command
      ->add_option("--scenes", arguments->scenes,
                   "Scenarios that are driven, an equal share by each policy; default: as many on each map for each "
                   "policy, two a map or more")
      ->transform(whole_number(1));
  command->add_option("--first-scene", worlds.first_scenario, "The number of the first scenario")
      ->transform(whole_number(0))
      ->capture_default_str();
  command->add_option("--every", probe->sample_steps, "Steps between sampled states")
      ->transform(whole_number(1))
      ->capture_default_str();
}

void add_output_options(CLI::App* command, ProbeArguments* arguments, ProbeOptions* probe, const char* out,
                        const char* files) {
  arguments->out = out;
  command
      ->add_option("--batch", probe->batch,
                   "Cases in a call, rounded up to whole passes of a network; changes memory and time alone")
      ->transform(whole_number(1, 1 << 20))
      ->capture_default_str();
  command->add_option("--out", arguments->out, fmt::format("The folder for {}", files))->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object, that of summary.json");
}

// Runs a probe with a progress line; makes the folder for its files before.
template <typename Results, typename Options>
Results run_probe(Results (*probe)(const Options&), ProbeArguments* arguments, Options* options) {
  EvaluateOptions& driven = options->worlds;
  arguments->evaluation.adds_walls = driven.adds_walls;  // the probe's own
  driven = arguments->evaluation;
  driven.densities = {density_named(arguments->density)};
  driven.scenarios =
      arguments->scenes > 0 ? arguments->scenes : default_probe_scenes(options->policies.size(), driven.maps.size());
  make_output_folder(arguments->out);
  ProgressLine line;
  driven.on_progress = [&line](double done, double eta_s) {
    line.update(fmt::format("probing: {:.0f} %  ETA {}", 100 * done, format_duration(eta_s)));
  };
  Results results = probe(*options);
  line.finish();
  return results;
}

/// With a digit more than evaluations have: changes of values are small.
std::string interval_of(const Estimate& estimate) { return interval_text(estimate, 4); }

size_t name_width(const ProbeResults& results) {
  size_t width = 6;
  for (const ProbedPolicy& policy : results.policies) width = std::max(width, policy.answers_as().size());
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
    print_result("{:{}} {:>10} {:>8} {:>7} {:>20} {:>20} {:>6.1f} %\n", results.policies[row.policy].answers_as(),
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
    print_result("{:{}} {:>12} {:>8} {:>7} {:>20} {:>20} {:>6.1f} %\n", results.policies[row.policy].answers_as(),
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
                 results.policies[row.policy].answers_as(), width, kCornerCaseNames[static_cast<size_t>(row.its_case)],
                 kWallNames[row.walls ? 0 : 1], row.revealed, row.reveal_s.front(), row.reveal_s.back(),
                 interval_of(row.at_reveal.distance_m), interval_of(row.at_reveal.speed_mps),
                 interval_of(row.at_reveal.deceleration_mps2));
  }
  print_result(
      "at the reveal, where line of sight past the walls opens; deceleration over the next 2 s, m/s2\n{}\n"
      "{} of {} pairs, of {} states with somebody hidden and {} empty ones, in {}\n",
      kEstimateNote, results.pairs.size(), results.pairs_asked, results.hidden_found, results.empty_found,
      format_duration(results.seconds));
}

/// Draws the chart of a probe's means as `name`, and those below the pages, or gives notice why not.
void draw_charts(const std::string& name, const Json& pages, FilledFolder* out) {
  const std::string chart = out->file(name);
  try {
    draw_chart({{"chart", "probe_charts"}, {"folder", out->path()}, {"pages", pages}});
  } catch (const NoMatplotlib& error) {
    std::filesystem::remove(chart);  // an earlier call's
    print_message("notice: {}\n", error.what());
  }
}

/// Writes summary.json, draws the charts, unless it has no pages (null), and prints the summary or a table.
template <typename Results, typename Row>
void report(const ProbeArguments& arguments, const std::string& summary, const Results& results,
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
  struct Arguments : ProbeArguments {
    RemovalOptions removal;
    CaseReplayOptions replay;
    std::string control = kRemovalControlNames[0];
  };
  auto arguments = std::make_shared<Arguments>();
  RemovalOptions& options = arguments->removal;
  CLI::App* command = probe.add_subcommand(
      "removal", "How value and braking change when one road user is taken away, by how occluded it is");
  add_world_options(command, arguments.get(), &options);
  command->add_option("--removals", options.removals, "Cases in all: one user hidden for one ego in one state")
      ->transform(whole_number(1))
      ->capture_default_str();
  command->add_option("--range", options.range_m, "How far away a user may be, m")
      ->transform(number(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--control", arguments->control,
                   "A control: nobody hides no one; permuted hides another of the ego's users, drawn anew for each "
                   "case; untrained has policies with fresh weights answer in the same states")
      ->check(one_of({kRemovalControlNames.begin(), kRemovalControlNames.end()}))
      ->capture_default_str();
  add_case_replay_options(command, &arguments->replay, kCaseOfReplay);
  add_output_options(command, arguments.get(), &options, "probe_removal", "cases.csv, summary.json and removal.png");
  command->footer(footer(kRemovalExamples));
  command->callback([arguments] {
    RemovalOptions& removal = arguments->removal;
    removal.control = removal_control_named(arguments->control);
    check_case_number(arguments->replay, removal.removals);
    const RemovalResults results = run_probe(&probe_removal, arguments.get(), &removal);
    const std::vector<RemovalRow> rows = summarize(results);
    FilledFolder out(arguments->out, "probe");
    const std::string cases_file = out.file("cases.csv");
    write_removal_cases(cases_file, results);
    report(*arguments, removal_summary_json(results, rows, cases_file), results, rows, Json::array(), &out);
    if (results.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} removals are done, and written to {}", results.cases.size(),
                                    results.removals_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, removal, results);
  });
}

void add_pedestrian_command(CLI::App& probe) {
  struct Arguments : ProbeArguments {
    PedestrianOptions pedestrian;
    CaseReplayOptions replay;
    std::string control = kPedestrianControlNames[0];
  };
  auto arguments = std::make_shared<Arguments>();
  PedestrianOptions& options = arguments->pedestrian;
  CLI::App* command = probe.add_subcommand(
      "pedestrian", "How value and braking change as a pedestrian comes out from behind a vehicle and is hidden again");
  add_world_options(command, arguments.get(), &options);
  command->add_option("--paths", options.paths, "Paths in all, each through one state; each has a figure")
      ->transform(whole_number(1))
      ->capture_default_str();
  command->add_option("--range", options.hider_range_m, "How far away the vehicle that a path begins behind may be, m")
      ->transform(number(6, 1000))
      ->capture_default_str();
  command->add_option("--min-speed", options.min_speed_mps, "Of the ego, forwards, m/s")
      ->transform(number(-100, 100))
      ->capture_default_str();
  command->add_option("--height", options.height_m, "Of the pedestrian, m; vehicles are 1.5 m high")
      ->transform(number(0.1, 3))
      ->capture_default_str();
  command
      ->add_option(
          "--control", arguments->control,
          "A control: nobody puts no pedestrian there; untrained has policies with fresh weights answer in the "
          "same states")
      ->check(one_of({kPedestrianControlNames.begin(), kPedestrianControlNames.end()}))
      ->capture_default_str();
  add_case_replay_options(command, &arguments->replay, kCaseOfReplay);
  add_output_options(command, arguments.get(), &options, "probe_pedestrian",
                     "cases.csv, summary.json, pedestrian.png and path_000.png, path_001.png, ...");
  command->footer(footer(kPedestrianExamples));
  command->callback([arguments] {
    PedestrianOptions& pedestrian = arguments->pedestrian;
    pedestrian.control = pedestrian_control_named(arguments->control);
    const PedestrianResults results = run_probe(&probe_pedestrian, arguments.get(), &pedestrian);
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
      throw Interrupted(fmt::format("interrupted; {} of {} paths are done, and written to {} without figures",
                                    results.paths.size(), results.paths_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, pedestrian, results);
  });
}

void add_corner_command(CLI::App& probe) {
  struct Arguments : ProbeArguments {
    CornerOptions corner;
    CaseReplayOptions replay;
    std::string control = kCornerControlNames[0];
  };
  auto arguments = std::make_shared<Arguments>();
  CornerOptions& options = arguments->corner;
  CLI::App* command = probe.add_subcommand(
      "corner", "How policies drive on towards blind corners with a hidden vehicle, and towards empty ones like them");
  add_world_options(command, arguments.get(), &options);
  command->add_option("--pairs", options.pairs, "Pairs in all: a corner with a hidden vehicle, and an empty one")
      ->transform(whole_number(1))
      ->capture_default_str();
  command
      ->add_option("--max-distance", options.search.max_distance_m,
                   "How far before the corner a policy may take over, m; at least 8 m")
      ->transform(number(8.1, kCornerLead_m))
      ->capture_default_str();
  command
      ->add_option("--min-speed", options.search.min_speed_mps,
                   "Of the ego at the takeover and of who is hidden, forwards, m/s")
      ->transform(number(-100, 100))
      ->capture_default_str();
  command
      ->add_option("--range", options.search.user_range_m, "How far before the junction the hidden vehicle may be, m")
      ->transform(number(1, kCornerLead_m))
      ->capture_default_str();
  command
      ->add_option("--driver", arguments->evaluation.controller,
                   "Who drives the scenes in which policies take over, instead of the policies: lane, the lane keeper")
      ->check(one_of({"lane"}));
  command
      ->add_option(
          "--control", arguments->control,
          "A control: permuted removes another vehicle near the ego instead of who is hidden; untrained has policies "
          "with fresh weights take over in the same states")
      ->check(one_of({kCornerControlNames.begin(), kCornerControlNames.end()}))
      ->capture_default_str();
  add_case_replay_options(command, &arguments->replay,
                          "The pair of --replay, as numbered in cases.csv; default: that of example.png");
  add_output_options(command, arguments.get(), &options, "probe_corner",
                     "cases.csv, summary.json, corner.png and example.png");
  command->footer(footer(kCornerExamples));
  command->callback([arguments] {
    CornerOptions& corner = arguments->corner;
    corner.control = corner_control_named(arguments->control);
    check_case_number(arguments->replay, corner.pairs);
    const CornerResults results = run_probe(&probe_corner, arguments.get(), &corner);
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
      throw Interrupted(fmt::format("interrupted; {} of {} pairs are done, and written to {}", results.pairs.size(),
                                    results.pairs_asked, arguments->out));
    }
    if (!arguments->replay.path.empty()) write_case_replay(arguments->replay, corner, results);
  });
}

}  // namespace

void add_probe_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("probe", "Ask policies what they see: probe removal, pedestrian, corner");
  command->require_subcommand(1);
  command->footer(footer({kRemovalExamples[0], kPedestrianExamples[0], kCornerExamples[0]}));
  add_removal_command(*command);
  add_pedestrian_command(*command);
  add_corner_command(*command);
}

}  // namespace pictura
