// `pictura evaluate`: computes the paper's driving metrics of a checkpoint or a controller, for each traffic density.
#include "pictura/evaluation/evaluate.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>

#include "pictura/apps/commands.h"
#include "pictura/apps/robust_evaluation.h"
#include "pictura/apps/scene_evaluation.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/recording_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/driving/replay_scenarios.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/infractions.h"
#include "pictura/evaluation/mixed_traffic.h"
#include "pictura/evaluation/progress.h"
#include "pictura/evaluation/robust_protocol.h"
#include "pictura/replay/gallery.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

namespace {

constexpr int kShownGroups = 6;          // maximum number of groups that are printed for each kind of infraction
constexpr double kManyNeverMoved = 0.2;  // share of vehicles above which a notice is printed

// Reports of an evaluation, one for each severity of randomized cameras.
using Reports = std::vector<EvaluateReport>;

// Row of the table with its label. The label contains the density, the name of another driver (without folders), and
// the severity if there are several.
struct LabelledRow {
  std::string label;
  EvaluateRow row;
};
std::vector<LabelledRow> labelled(const Reports& reports) {
  std::vector<LabelledRow> rows;
  for (const EvaluateReport& report : reports) {
    for (const EvaluateRow& row : report.rows) {
      std::string label = row.density;
      if (!row.driver.empty()) label += " " + std::filesystem::path(row.driver).filename().string();
      if (reports.size() > 1) label += fmt::format(", severity {}", report.results.setting.camera_severity);
      rows.push_back({label, row});
    }
  }
  return rows;
}

struct Effort {
  int64_t agent_steps = 0;
  double seconds = 0;
};
Effort effort_of(const Reports& reports) {
  Effort sum;
  for (const EvaluateReport& report : reports) {
    sum.agent_steps += report.agent_steps;
    sum.seconds += report.seconds;
  }
  return sum;
}

// Prints a line of the table: the name of a metric, and its text for each row.
template <typename Text>
void print_line(const std::vector<LabelledRow>& rows, size_t width, const char* metric, const Text& text_of) {
  std::string line = fmt::format("{:30}", metric);
  for (const LabelledRow& labelled : rows) line += fmt::format(" {:>{}}", text_of(labelled.row), width);
  print_result("{}\n", line);
}

// Prints a table with a line for each metric, and a column for each density, driver and severity. In this form the
// table fits a terminal.
void print_table(const Reports& reports) {
  const EvaluationSetting& setting = reports.front().results.setting;
  const std::vector<LabelledRow> rows = labelled(reports);
  size_t width = 18;
  std::string labels(30, ' ');
  for (const auto& [label, row] : rows) width = std::max(width, label.size());
  for (const auto& [label, row] : rows) labels += fmt::format(" {:>{}}", label, width);
  print_result("{}\n", labels);
  const auto line = [&](const char* metric, const auto& text_of) { print_line(rows, width, metric, text_of); };
  const auto estimate = [&](const char* metric, Estimate EvaluateRow::* of) {
    line(metric, [of](const EvaluateRow& row) { return interval_text(row.*of); });
  };
  line("scenarios x steps", [](const EvaluateRow& row) { return fmt::format("{} x {}", row.scenarios, row.steps); });
  line("vehicles", [](const EvaluateRow& row) { return fmt::format("{}", row.vehicle_episodes); });
  line("km driven", [](const EvaluateRow& row) { return fmt::format("{:.2f}", row.km_driven); });
  estimate("km per infraction", &EvaluateRow::km_per_infraction);
  line("vehicles with an infraction",
       [](const EvaluateRow& row) { return row.counts_infractions() ? fmt::format("{}", row.infractions) : "-"; });
  print_result("share of vehicles with\n");
  estimate("  a collision", &EvaluateRow::collision_rate);
  estimate("  a collision at fault", &EvaluateRow::at_fault_collision_rate);
  estimate("  leaving the road", &EvaluateRow::off_road_rate);
  estimate("  a red light", &EvaluateRow::red_light_rate);
  estimate("km per at-fault infraction", &EvaluateRow::km_per_at_fault_infraction);
  print_result("a vehicle's mean\n");
  estimate("  goals", &EvaluateRow::goals_per_vehicle);
  estimate("  waypoints", &EvaluateRow::waypoints_per_vehicle);
  estimate("  km", &EvaluateRow::km_per_vehicle);
  estimate("  return", &EvaluateRow::return_per_vehicle);
  print_result("share of vehicles that\n");
  estimate("  never moved", &EvaluateRow::never_moved_share);
  estimate("  are stuck at the end", &EvaluateRow::stuck_at_end_share);
  estimate("  touched a wall", &EvaluateRow::wall_contact_rate);
  estimate("share of time in reverse", &EvaluateRow::reversing_share);
  estimate("m moved per wait at red", &EvaluateRow::red_wait_moved_m);
  line("waits at red", [](const EvaluateRow& row) { return fmt::format("{}", row.red_waits); });
  for (const auto& [label, row] : rows) {
    if (row.left == 0) continue;
    print_result(
        "{}: vehicles are counted per life on roads that end: {} of {} agents spawned, {} entered, {} left; {} "
        "goals/km\n",
        label, row.spawned, row.asked, row.entered, row.left, interval_text(row.goals_per_km));
  }
  for (const auto& [label, row] : rows) {
    if (row.never_moved_share.value < kManyNeverMoved) continue;
    print_result("{}: {:.0f} % of the vehicles never moved, so few infractions mean little\n", label,
                 100 * row.never_moved_share.value);
  }
  print_result("traffic lights: {}\n", name_of(setting.light_cycles));
  if (!setting.others.empty()) print_result("shares of other drivers: {}\n", fmt::join(setting.others, ", "));
  if (reports.size() == 1 && setting.camera_severity > 0) {
    print_result("randomized cameras: severity {}\n", setting.camera_severity);
  }
  print_result("+- is the half width of a 95 % confidence interval over scenarios\n");
  const Effort effort = effort_of(reports);
  if (effort.agent_steps > 0) {
    const auto steps = static_cast<double>(effort.agent_steps);
    print_result("{} agent-steps in {}: {}/s\n", format_count(steps), format_duration(effort.seconds),
                 format_count(steps / effort.seconds));
  }
}

Json json_of(const EvaluateRow& row, double severity) {
  Json json = {{"density", row.density},
               {"driver", row.driver.empty() ? Json(nullptr) : Json(row.driver)},
               {"camera_severity", severity}};
  json.update(row_json(row));
  return json;
}

void print_report(const EvaluateOptions& options, const Reports& reports, const Json& infractions) {
  Json table = Json::array();
  for (const EvaluateReport& report : reports) {
    for (const EvaluateRow& row : report.rows) table.push_back(json_of(row, report.results.setting.camera_severity));
  }
  const EvaluationSetting& setting = reports.front().results.setting;
  const Effort effort = effort_of(reports);
  Json json = driver_json(options, setting);
  json.update({{"light_cycles", name_of(setting.light_cycles)},
               {"others", setting.others},
               {"interrupted", reports.back().interrupted},
               {"agent_steps", effort.agent_steps > 0 ? Json(effort.agent_steps) : Json(nullptr)},
               {"seconds", effort.agent_steps > 0 ? Json(effort.seconds) : Json(nullptr)},
               {"rows", table},
               {"infractions", infractions}});
  print_json(json);
}

void print_groups(const std::vector<InfractionGroup>& groups) {
  print_result("{:10} {:>7} {:>7}  {}\n", "infraction", "count", "share",
               "most frequent kinds of vehicles' infractions");
  std::map<std::string, int64_t> totals;
  for (const InfractionGroup& group : groups) totals[group.kind] += group.count;
  for (const auto& [kind, total] : totals) {
    int shown = 0;
    for (const InfractionGroup& group : groups) {
      if (group.kind != kind || shown == kShownGroups) continue;
      ++shown;
      print_result("{:10} {:>7} {:>5.1f} %  {}\n", kind, group.count,
                   100 * static_cast<double>(group.count) / static_cast<double>(total), group.how);
    }
  }
}

Json groups_json(const std::vector<InfractionGroup>& groups) {
  Json list = Json::array();
  for (const InfractionGroup& group : groups) {
    list.push_back({{"kind", group.kind}, {"how", group.how}, {"count", group.count}});
  }
  return list;
}

// Parses a range of scenarios. "N" means 0 to N - 1, and "A:B" means A to B - 1.
void parse_scenarios(const std::string& text, EvaluateOptions* options) {
  const size_t colon = text.find(':');
  const std::string_view all = text;
  const std::optional<uint64_t> first = colon == std::string::npos ? 0 : parse_unsigned(all.substr(0, colon));
  const std::optional<uint64_t> end = parse_unsigned(colon == std::string::npos ? all : all.substr(colon + 1));
  if (!first || !end || *end <= *first || *end > kMaxCount) {
    fail_usage("--scenarios: expected a number of 1 to {}, or A:B with 0 <= A < B, got '{}'", kMaxCount, text);
  }
  options->first_scenario = static_cast<int>(*first);
  options->scenarios = static_cast<int>(*end - *first);
}

// Returns the names of the controllers for towns, or for recorded scenes.
std::vector<std::string> driver_names(bool has_scenes) {
  if (!has_scenes) return town_controller_names();
  std::vector<std::string> names = record_controller_names();
  names.insert(names.end(), {"random", "idle", "idm_lanes"});
  return names;
}

void check_driver(const DriverOptions& options, bool has_parts, bool has_scenes) {
  if (options.checkpoint.empty() && options.controller.empty() && !has_parts) {
    fail_usage("evaluate: expected a CHECKPOINT, --policy, or --merge and the parts of an evaluation");
  }
  const std::vector<std::string> names = driver_names(has_scenes);
  if (!options.controller.empty() && std::find(names.begin(), names.end(), options.controller) == names.end()) {
    fail_usage("--policy: expected one of {}; got '{}'", fmt::join(names, ", "), options.controller);
  }
  if (!options.controller.empty() && !(options.renderer.empty() && options.samples.empty())) {
    fail_usage("--renderer, --samples: {} reads no images", options.controller);
  }
}

EvaluateReport merged(const std::vector<std::string>& paths) {
  std::vector<EvaluationResults> parts;
  for (const std::string& path : paths) parts.push_back(read_results(path));
  EvaluateReport report;
  report.results = merge(parts, paths);
  report.rows = rows_of(report.results);
  if (!report.results.counts_all_collisions) {
    print_message(
        "notice: --merge: files of an earlier version count only collisions at fault: collisions, walls and km per "
        "infraction are unknown; their km per infraction is km per at-fault infraction\n");
  }
  return report;
}

// Throws UsageError if a name occurs twice.
void reject_repeated(const char* option, std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  if (twice != names.end()) fail_usage("{}: '{}' is given twice", option, *twice);
}

// Rejects repeated names of other drivers, and misspelt names that would be read as files.
void check_others(const std::vector<std::string>& others) {
  std::vector<std::string> known = town_controller_names(), names;
  for (const std::string& name : impairment_names()) known.push_back(name);
  for (const std::string& text : others) {
    const std::string& name = names.emplace_back(text.substr(0, text.rfind('=')));
    if (std::find(known.begin(), known.end(), name) != known.end() || std::filesystem::exists(name)) continue;
    if (const std::string near = suggestion(name, known); !near.empty())
      fail_usage("--others: expected {}, or a policy's file, got '{}'{}", fmt::join(known, ", "), name, near);
  }
  reject_repeated("--others", names);
}

struct EvaluateArguments {
  EvaluateOptions evaluation;
  std::vector<std::string> densities{kDensityNames.begin(), kDensityNames.end()};
  std::vector<std::string> parts;
  std::vector<double> severities{0};
  std::string size, scenarios = "200", out, infractions;
  bool json = false;
  SceneArguments scenes;
  std::string replay, gallery;
  int replays = 0;
  RecordingOptions recording;
};

void evaluate_in_scenes(const CLI::App& command, const EvaluateArguments& arguments) {
  const EvaluateOptions& evaluation = arguments.evaluation;
  check_driver(evaluation, /*has_parts=*/false, /*has_scenes=*/true);
  reject_recording_options(command, "--replay or --gallery");
  reject_options(command, {"--light-heads"}, "in recorded scenes, whose light heads are all beyond their stop line");
  reject_options(command, {"--others"}, "in recorded scenes");
  if (arguments.severities.size() > 1) fail_usage("--camera-severity: in recorded scenes expected one, got several");
  SceneEvaluateOptions in_scenes;
  static_cast<DriverOptions&>(in_scenes) = evaluation;
  in_scenes.camera_severity = arguments.severities.front();
  in_scenes.first_scene = evaluation.first_scenario;
  in_scenes.num_scenes = command.count("--scenarios") > 0 ? evaluation.scenarios : 0;
  run_scene_evaluation(command, arguments.scenes, evaluation.steps, arguments.densities, std::move(in_scenes),
                       arguments.out, arguments.json);
}

// Simulates the worst scenarios again and writes their replays, if requested.
void replay_worst(const EvaluateArguments& arguments, const EvaluationResults& results) {
  const EvaluateOptions& evaluation = arguments.evaluation;
  if (!arguments.replay.empty()) {
    write_scenario_replay(evaluation, results, arguments.recording, arguments.replay);
  }
  if (!arguments.gallery.empty()) {
    write_scenario_replays(evaluation, results, arguments.recording, arguments.replays, arguments.gallery);
  }
}

// Rejects several severities together with options that do not support them.
void check_severities(const CLI::App& command, const EvaluateArguments& arguments) {
  if (arguments.severities.size() == 1) return;
  reject_options(command, {"--out", "--infractions", "--replay", "--gallery"},
                 "with several values of --camera-severity");
}

// Rejects a followed agent that worlds of some density lack, because any scenario may be the worst one.
void check_followed(const EvaluateArguments& arguments) {
  const EvaluateOptions& evaluation = arguments.evaluation;
  int num_agents = evaluation.agents_per_world > 0 ? evaluation.agents_per_world : kMaxAgentsPerWorld;
  for (const Density density : evaluation.densities) {
    if (evaluation.agents_per_world == 0)
      num_agents = std::min(num_agents, kDensityAgents[static_cast<size_t>(density)]);
  }
  const int followed = arguments.recording.followed.value_or(0);
  if (followed >= num_agents) fail_usage("--follow: expected 0 to {}, got {}", num_agents - 1, followed);
}

// Evaluates at each severity, in the same worlds. Ends early after an interrupt.
Reports evaluate_severities(const std::vector<double>& severities, EvaluateOptions* evaluation) {
  EvaluationProgress progress("the completed scenarios", "--scenarios A:B evaluates a range");
  const std::function<void(double, double)> update = [&progress](double done, double eta_s) {
    progress.update(done, eta_s);
  };
  Reports reports;
  for (const double severity : severities) {
    evaluation->on_progress = progress_of_part(update, std::ssize(reports), std::ssize(severities));
    evaluation->camera_severity = severity;
    reports.push_back(evaluate(*evaluation));
    if (reports.back().interrupted) break;
  }
  evaluation->on_progress = nullptr;
  progress.finish();
  return reports;
}

// Evaluates in towns, or merges parts of such evaluations.
void evaluate_in_towns(const CLI::App& command, EvaluateArguments* arguments) {
  EvaluateOptions& evaluation = arguments->evaluation;
  const bool merges = !arguments->parts.empty(), lists_infractions = !arguments->infractions.empty();
  evaluation.densities.clear();
  for (const std::string& name : arguments->densities) evaluation.densities.push_back(density_named(name));
  if (evaluation.agents_per_world > 0) {
    reject_options(command, {"--density"}, "with --agents, which replaces it");
    evaluation.densities.resize(1);
  }
  check_driver(evaluation, merges, /*has_scenes=*/false);
  const bool records = !arguments->replay.empty() || !arguments->gallery.empty();
  if (!records) reject_recording_options(command, "--replay or --gallery");
  if (!evaluation.others.empty() && (records || lists_infractions)) {
    fail_usage("--others: cannot be combined with --replay, --gallery or --infractions");
  }
  check_severities(command, *arguments);
  check_others(evaluation.others);
  check_followed(*arguments);
  std::optional<OutputFolder> gallery;
  if (!arguments->gallery.empty()) {
    gallery.emplace(arguments->gallery);
    check_gallery(arguments->gallery);
  }
  InfractionObserver infractions;
  if (lists_infractions) evaluation.observer = &infractions;
  const Reports reports =
      merges ? Reports{merged(arguments->parts)} : evaluate_severities(arguments->severities, &evaluation);
  evaluation.observer = nullptr;
  const std::vector<InfractionGroup> groups = group_infractions(infractions.found());
  if (arguments->json)
    print_report(evaluation, reports, lists_infractions ? groups_json(groups) : Json(nullptr));
  else
    print_table(reports);
  if (lists_infractions && !arguments->json) print_groups(groups);
  const bool interrupted = reports.back().interrupted;
  const EvaluationResults& results = reports.front().results;
  const auto write_infractions = [&] {
    if (lists_infractions) write_infractions_csv(arguments->infractions, infractions.found());
  };
  const auto write_counts = [&] {
    if (!arguments->out.empty()) write_results(arguments->out, results);
  };
  const auto write_replays = [&] {
    if (!interrupted) replay_worst(*arguments, results);
  };
  call_all({write_infractions, write_counts, write_replays});
  if (!interrupted) return;
  int finished = 0;
  for (const auto& [label, row] : labelled(reports)) finished += row.driver.empty() ? row.scenarios : 0;
  const size_t num_densities = evaluation.agents_per_world > 0 ? 1 : evaluation.densities.size();
  throw Interrupted(
      fmt::format("interrupted; {} of {} scenarios are completed and counted above", finished,
                  arguments->severities.size() * num_densities * static_cast<size_t>(evaluation.scenarios)));
}

void run_evaluate(const CLI::App& command, EvaluateArguments* arguments) {
  EvaluateOptions& evaluation = arguments->evaluation;
  if (!arguments->size.empty()) {
    const Pair pixels = parse_pair("--size", arguments->size, 8192);
    evaluation.width_px = pixels.first;
    evaluation.height_px = pixels.second;
  }
  reject_repeated("--density", arguments->densities);
  if (arguments->scenes.protocol == kRobustProtocol) {
    if (command.count("--scenarios") > 0) parse_scenarios(arguments->scenarios, &evaluation);
    check_driver(evaluation, /*has_parts=*/false, /*has_scenes=*/false);
    return run_robust_evaluation(command, evaluation, arguments->json);
  }
  reject_idle_scene_options(command, arguments->scenes);
  const bool has_scenes = !arguments->scenes.protocol.empty();
  if (!has_scenes || command.count("--scenarios") > 0) parse_scenarios(arguments->scenarios, &evaluation);
  if (has_scenes) return evaluate_in_scenes(command, *arguments);
  if (!arguments->parts.empty()) reject_other_options(command, {"--merge", "--out", "--json"}, "with --merge");
  if (arguments->parts.empty() || !has_scene_results(arguments->parts.front())) {
    return evaluate_in_towns(command, arguments);
  }
  merge_scene_evaluations(arguments->parts, arguments->out, arguments->json);
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  auto arguments = std::make_shared<EvaluateArguments>();
  EvaluateOptions& options = arguments->evaluation;
  CLI::App* command = app.add_subcommand("evaluate", "Measure a policy's driving (the paper's protocols)");
  CLI::Option* const checkpoint =
      command->add_option("CHECKPOINT", options.checkpoint, "Checkpoint written by train, or safetensors")
          ->check(input_file());
  CLI::Option* const policy =
      command
          ->add_option(
              "--policy", options.controller,
              fmt::format(
                  "Controller that drives instead of the checkpoint's policy: {}; in recorded scenes {}, random, idle "
                  "or idm_lanes. The world is that of the checkpoint's training, or without a checkpoint the paper's",
                  fmt::join(town_controller_names(), ", "), fmt::join(record_controller_names(), ", ")))
          ->check(one_of(host_controller_names()));
  command
      ->add_option("--merge", arguments->parts,
                   "Instead of evaluating: merge the parts of one evaluation, which --out wrote; the result is exactly "
                   "that of the whole evaluation")
      ->check(input_file())
      ->excludes(checkpoint)
      ->excludes(policy);
  add_evaluation_options(command, &arguments->evaluation)->excludes(policy);
  add_average_option(command, &options.average)->excludes(policy);
  add_decision_steps_option(command, &options.decision_steps)->excludes(policy);
  command
      ->add_option("--density", arguments->densities,
                   "light, medium, dense: 60, 120, 150 agents per world; with --protocol: percentages of road users "
                   "that remain, for instance 100,75,50; default: those of the protocol")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command
      ->add_option("--others", options.others,
                   fmt::format("Other drivers with their shares of vehicles, for instance "
                               "lane=0.25,models/vector.safetensors=0.25: policy files or {}. Or shares of agents that "
                               "the policy drives while impaired: {}. The report has metrics of each driver",
                               fmt::join(town_controller_names(), ", "), fmt::join(impairment_names(), ", ")))
      ->delimiter(',')
      ->check(input_file())
      ->allow_extra_args(false);
  command
      ->add_option(
          "--scenarios", arguments->scenarios,
          fmt::format(
              "Scenarios per density: N, or A:B for scenarios A to B - 1; with --protocol: scenes, default: all; "
              "with --protocol robust: scenarios per condition, default: {}",
              kRobustScenarios))
      ->capture_default_str();
  CLI::Option* const rig =
      command->add_option("--rig", options.rig,
                          "Rig file, whose cameras replace the cameras of the training; their number must be the same");
  rig->check(input_file())->excludes(policy);
  command
      ->add_option("--size", arguments->size, "Image size of the paper's rig in pixels, WxH; default: as in training")
      ->excludes(rig)
      ->excludes(policy);
  command
      ->add_option("--camera-severity", arguments->severities,
                   fmt::format("Severity of randomized cameras, from 0 (as mounted) over 1 (full randomization) to {} "
                               "(docs/explanation/cameras.md); several numbers, separated by commas, give one result "
                               "each, for instance 0,0.25,0.5,1",
                               kMaxCameraSeverity))
      ->delimiter(',')
      ->transform(number(0, kMaxCameraSeverity))
      ->allow_extra_args(false)
      ->excludes(policy);
  command
      ->add_option("--backbone", options.backbone,
                   "Path of the program of policy.backbone, if it has moved since training")
      ->check(input_file());
  command->add_option("--out", arguments->out, "File for the counts of each scenario or scene, for --merge")
      ->check(output_file());
  command
      ->add_option(
          "--infractions", arguments->infractions,
          "File with the place, partner and speed of every infraction; also prints a table of the most frequent kinds")
      ->check(output_file({".csv"}));
  command
      ->add_option("--replay", arguments->replay,
                   "Simulate the worst scenario again, and record it as a page for browsers")
      ->check(output_file({".html"}));
  CLI::Option* const replays =
      add_number_option(command, "--replays", arguments->replays,
                        "Simulate the N worst scenarios again, and record them in --gallery", 1);
  CLI::Option* const gallery = command->add_option(
      "--gallery", arguments->gallery,
      "Folder for the pages of --replays and their index; replaces the pages of an earlier gallery");
  replays->needs(gallery);
  gallery->needs(replays);
  add_recording_options(command, &arguments->recording);
  add_scene_options(command, &arguments->scenes);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura evaluate runs/town01/checkpoint.ckpt --map Town01 --density light --scenarios 4 --steps "
      "600\n"
      "  pictura evaluate --policy lane --density medium --scenarios 8\n"
      "  pictura evaluate run.ckpt --map Town05 --scenarios 50 --replays 10 --gallery replays\n"
      "  pictura evaluate run.ckpt --density medium --scenarios 40 --infractions infractions.csv\n"
      "  pictura evaluate run.ckpt --protocol womd --scenes validation/ --density 100,50 --csv agents.csv\n"
      "  pictura evaluate run.ckpt --density medium --scenarios 40 --others lane=0.3,idm_lanes=0.2\n"
      "  pictura evaluate run.ckpt --density medium --scenarios 40 --camera-severity 0,0.25,0.5,1\n"
      "  pictura evaluate run.ckpt --protocol robust\n"
      "Evaluation in parts, on several machines or one after another:\n"
      "  pictura evaluate run.ckpt --scenarios 0:100 --out a.json\n"
      "  pictura evaluate run.ckpt --scenarios 100:200 --out b.json\n"
      "  pictura evaluate --merge a.json b.json\n"
      "Rollouts for the Waymo sim-agents challenge:\n"
      "  pictura evaluate run.ckpt --protocol simagents --scenes validation --sampled --rollouts rollouts.binproto");
  command->callback([arguments, command] { run_evaluate(*command, arguments.get()); });
}

}  // namespace pictura
