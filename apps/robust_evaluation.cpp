#include "pictura/apps/robust_evaluation.h"

#include <cmath>
#include <string>

#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/robust_protocol.h"

namespace pictura {

namespace {

// Returns the ratio of a condition's goals to those of the first condition, or NaN if the first condition has none.
double goals_kept(const RobustReport& report, const EvaluateRow& row) {
  return row.goals_per_vehicle.value / report.metrics(report.rows.front()).goals_per_vehicle.value;
}

std::string number_text(double value) { return std::isfinite(value) ? fmt::format("{:.2f}", value) : "-"; }

// Prints a row's name and its texts in columns. The first column of texts is wider than the others.
void print_columns(const std::string& name, const std::vector<std::string>& texts) {
  std::string line = fmt::format("{:24}", name);
  for (size_t i = 0; i < texts.size(); ++i) line += fmt::format(" {:>{}}", texts[i], i == 0 ? 18 : 11);
  print_result("{}\n", line);
}

void print_row(const RobustReport& report, const std::string& name, const EvaluateRow& row) {
  const auto share = [](const Estimate& estimate) { return fmt::format("{:.3f}", estimate.value); };
  print_columns(name, {interval_text(row.km_per_infraction, 2), fmt::format("{}", row.infractions),
                       number_text(row.goals_per_vehicle.value), number_text(goals_kept(report, row)),
                       share(row.at_fault_collision_rate), share(row.off_road_rate), share(row.red_light_rate),
                       share(row.never_moved_share)});
}

void print_table(const RobustReport& report, int scenarios) {
  print_columns("", {"km per infraction", "infractions", "goals", "goals kept", "at fault", "off-road", "red light",
                     "never moved"});
  for (const RobustRow& row : report.rows) {
    const std::string name = fmt::format("{}: {}", row.condition.part, row.condition.name);
    if (!row.not_driven.empty())
      print_result("{:24} {:>18}  not driven: {}\n", name, "-", row.not_driven);
    else if (!row.counts.scenarios.empty())
      print_row(report, name, report.metrics(row));
  }
  for (const auto& [part, row] : report.pooled()) {
    print_row(report, part == "all" ? "all but carla" : "all of " + part, row);
  }
  print_result(
      "goals: mean per vehicle; goals kept: ratio to the goals of the first row; at fault to never moved: shares of "
      "vehicles\n");
  print_result("+- is the half width of a 95 % confidence interval over {} scenarios of {} steps per condition\n",
               scenarios, kRobustSteps);
  if (scenarios != kRobustScenarios) {
    print_result("a trial: results are comparable with others' results only for {} scenarios per condition\n",
                 kRobustScenarios);
  }
}

Json pooled_json(const RobustReport& report) {
  Json parts = Json::object();
  for (const auto& [part, row] : report.pooled()) parts[part] = row_json(row);
  return parts;
}

void print_report(const RobustOptions& options, const RobustReport& report) {
  Json rows = Json::array();
  for (const RobustRow& row : report.rows) {
    Json json = {{"part", row.condition.part},
                 {"name", row.condition.name},
                 {"maps", row.condition.maps},
                 {"agents_per_world", row.condition.agents_per_world},
                 {"others", row.condition.others},
                 {"camera_severity", row.condition.camera_severity},
                 {"not_driven", row.not_driven.empty() ? Json(nullptr) : Json(row.not_driven)}};
    if (!row.counts.scenarios.empty()) {
      const EvaluateRow metrics = report.metrics(row);
      json["goals_kept"] = finite_or_null(goals_kept(report, metrics));
      json.update(row_json(metrics));
    }
    rows.push_back(std::move(json));
  }
  Json json = driver_json(options, report.setting);
  json.update({{"protocol", kRobustProtocol},
               {"is_comparable", options.scenarios == kRobustScenarios && !report.interrupted},
               {"interrupted", report.interrupted},
               {"agent_steps", report.agent_steps},
               {"seconds", report.seconds},
               {"rows", rows},
               {"pooled", pooled_json(report)}});
  print_json(json);
}

}  // namespace

void run_robust_evaluation(const CLI::App& command, const EvaluateOptions& options, bool json) {
  reject_other_options(
      command,
      {"--protocol", "--scenarios", "--json", "--policy", "--device", "--simulator", "--renderer", "--samples",
       "--threads", "--sampled", "--average", "--decision-steps", "--rig", "--size", "--backbone"},
      "with --protocol robust, which fixes what is driven");
  if (options.first_scenario != 0) fail_usage("--scenarios: with --protocol robust expected a number, got a part");
  RobustOptions driven;
  static_cast<DriverOptions&>(driven) = options;
  if (command.count("--scenarios") > 0) driven.scenarios = options.scenarios;
  EvaluationProgress progress("the conditions that are finished", "--scenarios N evaluates N of each condition");
  driven.on_progress = [&progress](double done, double eta_s) { progress.update(done, eta_s); };
  const RobustReport report = evaluate_robust(driven);
  progress.finish();
  if (json)
    print_report(driven, report);
  else
    print_table(report, driven.scenarios);
  if (report.interrupted) throw Interrupted("interrupted; finished conditions are reported above");
}

}  // namespace pictura
