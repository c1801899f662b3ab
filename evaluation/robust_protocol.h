// Robust protocol: one table of a driver's performance in generated towns, among other drivers, and with randomized
// cameras. The protocol fixes everything except the driver, so that results of different drivers are comparable.
// Includes no torch headers.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

constexpr const char* kRobustProtocol = "robust";  // name of the protocol in commands
constexpr int kRobustScenarios = 24;               // per condition
constexpr int kRobustSteps = 1200;                 // steps of 0.1 s
constexpr uint64_t kRobustSeed = 1;

/// Worlds of one row of the table.
struct RobustCondition {
  std::string part;                 // "towns", "carla", "others" or "cameras"
  std::string name;                 // unique
  std::vector<std::string> maps;    // names of maps for load_map()
  int agents_per_world = 0;         // agents of all classes
  std::vector<std::string> others;  // in the format of other_drivers()
  double camera_severity = 0;       // as SessionOptions::camera_severity
};

/// Returns the conditions in the order of the table. The first condition is the reference with which all others are
/// compared.
const std::vector<RobustCondition>& robust_conditions();

/// Metrics of the evaluated driver in one condition.
struct RobustRow {
  RobustCondition condition;
  DensityResult counts;    // without scenarios if the condition does not apply
  std::string not_driven;  // why the condition does not apply to the driver; empty if it applies
};

struct RobustReport {
  EvaluationSetting setting;  // setting of the first condition
  std::vector<RobustRow> rows;
  bool interrupted = false;  // an interrupt came; completed conditions are reported
  double seconds = 0;
  int64_t agent_steps = 0;

  /// Returns the metrics of a row's scenarios.
  EvaluateRow metrics(const RobustRow& row) const;
  /// Returns the pooled metrics of each of the parts "towns", "others" and "cameras", over all scenarios of the part's
  /// rows. The entry "all" pools all parts except "carla", because users must supply CARLA's maps. Parts without driven
  /// scenarios are left out.
  std::vector<std::pair<std::string, EvaluateRow>> pooled() const;
};

struct RobustOptions : DriverOptions {
  int scenarios = kRobustScenarios;  // per condition; only results with the default number are comparable
  std::function<void(double done_fraction, double eta_s)> on_progress;
};

template <typename Visitor>
void visit_options(RobustOptions& options, Visitor&& v) {
  v.value({"checkpoint"}, options.checkpoint);
  v.controller({"controller"}, options);
  v.value({"scenarios"}, options.scenarios);
  visit_options(static_cast<DriverOptions&>(options), v);
  v.callback({"on_progress"}, options.on_progress);
}

/// Evaluates a driver in every condition that applies to it. Conditions with randomized cameras apply to drivers that
/// read images. The condition with impaired drivers applies to drivers that read observations. The condition "carla"
/// applies if the map folder contains CARLA's towns. Throws UsageError if the options set a seed, camera_severity,
/// conditioning or lights other than the protocol's. Otherwise throws as evaluate() does.
RobustReport evaluate_robust(const RobustOptions& options);

}  // namespace pictura
