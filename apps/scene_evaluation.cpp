#include "pictura/apps/scene_evaluation.h"

#include <memory>

#include "pictura/apps/realism_table.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/output_file.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/robust_protocol.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

namespace {

double parse_density(const std::string& text) {
  const std::optional<double> percent = parse_number(text);
  if (!percent || !(*percent > 0) || *percent > 100) {
    fail_usage("--density: with --protocol expected shares in %, above 0 and at most 100, got '{}'", text);
  }
  return *percent / 100;
}

void print_settings(const SceneProtocol& protocol) {
  print_result("protocol {}: control {}, start {}, {} steps\n", protocol.name, protocol.control, protocol.start_step,
               protocol.steps);
  std::string rules;
  for (const auto& [name, value] : rules_of(protocol)) rules += fmt::format(" {}={}", name, value);
  print_result("rules:{}\n", rules);
}

void print_table(const SceneEvaluation& evaluation) {
  const SceneProtocol& protocol = evaluation.results.protocol;
  print_settings(protocol);
  const SceneResults& results = evaluation.results;
  print_result("{} scenes: {} scored, {} without a road user to drive, {} faults\n", evaluation.found, results.scored(),
               results.without_drivers, evaluation.faults().size());
  if (results.repaired_headings > 0) print_result("{} first headings repaired\n", results.repaired_headings);
  print_result("\n");
  constexpr const char* kLine = "{:8} {:34} {:>8} {:>9} {:>17} {:>17} {:>17} {:>17} {:>17} {:>9}\n";
  print_result(fmt::runtime(kLine), "density", "agent", "scenes", "vehicles", "at-fault", "off-road", "goals",
               "collisions", "displacement m", "km");
  for (const SceneRow& row : evaluation.rows) {
    const std::string density = fmt::format("{:g} %", 100 * row.density);
    print_result(fmt::runtime(kLine), density, "this", row.scenes, row.vehicle_episodes,
                 interval_text(row.at_fault_collision_rate), interval_text(row.off_road_rate),
                 interval_text(row.goal_rate), interval_text(row.collision_rate),
                 interval_text(row.mean_displacement_m), fmt::format("{:.2f}", row.km_driven));
    if (protocol.name != scene_protocols().front().name) continue;
    for (const PaperSceneRow& paper : paper_scene_rows()) {
      if (paper.density != row.density) continue;
      const auto rate = [](double value) { return fmt::format("{:.3f}", value); };
      print_result(fmt::runtime(kLine), density, fmt::format("paper: {}", paper.agent), "44073", "",
                   rate(paper.at_fault), rate(paper.off_road), rate(paper.goals), "", "", "");
    }
  }
  print_result("+- is the half width of a 95 % confidence interval over scenes\n");
  if (evaluation.seconds <= 0) return;
  const auto steps = static_cast<double>(results.agent_steps());
  print_result("{} agent-steps in {}: {}/s, {:.1f} scenes per minute\n", format_count(steps),
               format_duration(evaluation.seconds), format_count(steps / evaluation.seconds),
               60 * results.scored() / evaluation.seconds);
}

// Prints a report, without the duration if it is unknown, as for merged parts.
void print_report(const DriverOptions& options, const SceneEvaluation& evaluation) {
  const SceneResults& results = evaluation.results;
  const SceneProtocol& protocol = results.protocol;
  Json rows = Json::array();
  for (const SceneRow& row : evaluation.rows) {
    Json json = {{"density", row.density},
                 {"scenes", row.scenes},
                 {"vehicle_episodes", row.vehicle_episodes},
                 {"km_driven", row.km_driven}};
    for (const auto& [name, estimate] : metrics_of(row)) add_estimate(name, estimate, &json);
    rows.push_back(std::move(json));
  }
  Json paper = Json::array();
  for (const PaperSceneRow& row : paper_scene_rows()) {
    paper.push_back({{"agent", row.agent},
                     {"density", row.density},
                     {"at_fault_collision_rate", row.at_fault},
                     {"off_road_rate", row.off_road},
                     {"goal_rate", row.goals}});
  }
  Json rules = Json::object();
  for (const auto& [name, value] : rules_of(protocol)) rules[name] = value;
  Json json = driver_json(options, results.setting);
  json.update({{"protocol", protocol.name},
               {"control", protocol.control},
               {"start_step", protocol.start_step},
               {"steps", protocol.steps},
               {"rules", rules},
               {"scenes", evaluation.found},
               {"scored", results.scored()},
               {"without_drivers", results.without_drivers},
               {"repaired_headings", results.repaired_headings},
               {"faults", evaluation.faults()},
               {"interrupted", evaluation.interrupted},
               {"agent_steps", results.agent_steps()},
               {"seconds", evaluation.seconds > 0 ? Json(evaluation.seconds) : Json(nullptr)},
               {"rows", rows},
               {"paper_rows", paper}});
  if (!evaluation.realism.version.empty()) json["realism"] = realism_json(evaluation.realism);
  print_json(json);
}

void print(const DriverOptions& options, const SceneEvaluation& evaluation, bool json) {
  print_warnings("left out", evaluation.faults());
  if (json)
    print_report(options, evaluation);
  else
    print_table(evaluation);
  if (!json && !evaluation.realism.version.empty()) {
    print_result("\n");
    print_realism(evaluation.realism);
  }
}

}  // namespace

void add_scene_options(CLI::App* command, SceneArguments* arguments) {
  const std::vector<std::string> names = scene_protocol_names();
  std::vector<std::string> protocols = names;
  protocols.emplace_back(kRobustProtocol);
  std::vector<std::string> rules;
  for (const SceneRule& rule : scene_rules()) {
    rules.push_back(fmt::format("{} ({}): {}", rule.name, rule.values, rule.what));
  }
  command
      ->add_option(
          "--protocol", arguments->protocol,
          fmt::format("Evaluate in recorded scenes instead of on maps: womd, the paper's zero-shot protocol, or {}, "
                      "with the settings of these benchmarks. Or {}: evaluate in generated towns, with other drivers "
                      "and randomized cameras; all settings are fixed, so that results are comparable",
                      fmt::join(names.begin() + 1, names.end(), ", "), kRobustProtocol))
      ->check(one_of(protocols));
  command
      ->add_option("--scenes", arguments->scenes,
                   "Scenes of the protocol: files, folders of files, FILE#K or FILE#SCENARIO_ID, separated by commas")
      ->check(input_file())
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option(
      "--control", arguments->control,
      "Driven tracks, separated by commas: self or sdc (the self-driving car), vehicles (all other vehicles), others "
      "(non-vehicles), all, tracks_to_predict, objects_of_interest, and ids; default: those of the protocol");
  add_number_option(command, "--start", arguments->start_step,
                    "Step of the recordings at which episodes begin; default: that of the protocol", 0,
                    kMaxScenarioSteps - 1);
  command
      ->add_option("--rule", arguments->rules,
                   fmt::format("NAME=VALUE, which replaces a setting of the protocol; may be given several times. {}",
                               fmt::join(rules, "; ")))
      ->allow_extra_args(false);
  command->add_option("--csv", arguments->csv, "File with a row for every driven road user of every scene")
      ->check(output_file({".csv"}));
  command
      ->add_option("--rollouts", arguments->rollouts,
                   "With --protocol simagents: file for the rollouts, in the format of the Waymo sim-agents challenge")
      ->check(output_file());
  command
      ->add_option("--realism", arguments->realism,
                   "With --protocol simagents: score how realistic the rollouts are; the value is the year of the "
                   "challenge whose weights are used. pictura score does the same for a file of rollouts")
      ->check(one_of(realism_version_names()));
}

void reject_idle_scene_options(const CLI::App& command, const SceneArguments& arguments) {
  if (arguments.protocol.empty()) {
    reject_options(command, {"--scenes", "--control", "--start", "--rule", "--csv", "--rollouts", "--realism"},
                   "without --protocol");
    return;
  }
  reject_options(command, {"--map", "--agents", "--merge", "--infractions", "--replay", "--replays", "--light-cycles"},
                 "with --protocol");
  if (arguments.scenes.empty()) fail_usage("--protocol: expected also --scenes");
}

void run_scene_evaluation(const CLI::App& command, const SceneArguments& arguments, int steps,
                          const std::vector<std::string>& densities, SceneEvaluateOptions options,
                          const std::string& out, bool json) {
  options.scenes = arguments.scenes;
  options.hashes_scenes = !out.empty();
  SceneProtocol& protocol = options.protocol;
  protocol = scene_protocol(arguments.protocol);
  if (command.count("--control") > 0) protocol.control = arguments.control;
  protocol.start_step = arguments.start_step.value_or(protocol.start_step);
  if (command.count("--steps") > 0) protocol.steps = steps;
  if (command.count("--density") > 0) {
    protocol.densities.clear();
    for (const std::string& density : densities) protocol.densities.push_back(parse_density(density));
  }
  for (const std::string& rule : arguments.rules) set_scene_rule(rule, &protocol);
  std::unique_ptr<OutputFile> csv;
  if (!arguments.csv.empty()) {
    csv = std::make_unique<OutputFile>(arguments.csv);
    csv->write(scene_agents_csv_head());
    options.on_agent = [&csv](const SceneAgent& agent) { csv->write(csv_line(agent)); };
  }
  std::unique_ptr<RolloutsFile> rollouts;
  options.realism = arguments.realism;
  if (!arguments.rollouts.empty() || !arguments.realism.empty()) {
    check_rollouts(protocol);
    if (options.controller.empty() && options.argmax) {
      print_message(
          "notice: the rollouts of a scene are equal, since the most likely actions are used; --sampled samples "
          "actions\n");
    }
  }
  if (!arguments.rollouts.empty()) {
    rollouts = std::make_unique<RolloutsFile>(arguments.rollouts);
    options.on_rollouts = [&rollouts](const SceneRollouts& scene) { rollouts->write(scene); };
  }
  EvaluationProgress progress("the completed scenes", "--scenarios A:B evaluates a range");
  options.on_progress = [&progress](double done, double eta_s) { progress.update(done, eta_s); };
  const SceneEvaluation evaluation = evaluate_scenes(options);
  progress.finish();
  print(options, evaluation, json);
  const auto write_csv = [&csv] {
    if (csv) csv->commit();
  };
  const auto write_rollouts = [&rollouts] {
    if (rollouts) rollouts->commit();
  };
  const auto write_counts = [&] {
    if (!out.empty()) write_results(out, evaluation.results);
  };
  call_all({write_csv, write_rollouts, write_counts});
  if (evaluation.interrupted) {
    throw Interrupted(fmt::format("interrupted; {} of {} scenes are completed and counted above",
                                  evaluation.results.num_scenes, evaluation.found));
  }
}

void merge_scene_evaluations(const std::vector<std::string>& paths, const std::string& out, bool json) {
  std::vector<SceneResults> parts;
  for (const std::string& path : paths) parts.push_back(read_scene_results(path));
  SceneEvaluation evaluation;
  evaluation.results = merge(parts, paths);
  evaluation.rows = rows_of(evaluation.results);
  evaluation.found = evaluation.results.num_scenes;
  print(DriverOptions{}, evaluation, json);
  if (!out.empty()) write_results(out, evaluation.results);
}

}  // namespace pictura
