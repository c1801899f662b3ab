// Robust protocol: a driver's performance in generated towns, among other drivers, and with randomized cameras.
// Evaluations differ only in the driver, so their results are comparable.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

constexpr const char* kRobustProtocol = "robust";  // name in commands
constexpr int kRobustScenarios = 24;               // per condition
constexpr int kRobustSteps = 1200;                 // 0.1 s each
constexpr uint64_t kRobustSeed = 1;

/// Worlds of one table row.
struct RobustCondition {
  std::string part;                 // "towns", "carla", "others" or "cameras"
  std::string name;                 // unique
  std::vector<std::string> maps;    // for load_map()
  int agents_per_world = 0;         // all classes
  std::vector<std::string> others;  // see other_drivers()
  double camera_severity = 0;       // see SessionOptions
};

/// Returns the conditions in the table's order. The first is the reference of the others.
const std::vector<RobustCondition>& robust_conditions();

struct RobustRow {
  RobustCondition condition;
  DensityResult counts;    // empty if the condition does not apply
  std::string not_driven;  // reason why the condition does not apply, or empty
};

struct RobustReport {
  EvaluationSetting setting;  // the first condition's setting
  std::vector<RobustRow> rows;
  bool interrupted = false;  // completed conditions are reported
  double seconds = 0;
  int64_t agent_steps = 0;

  EvaluateRow metrics(const RobustRow& row) const;
  /// Returns the metrics of the parts "towns", "others" and "cameras", and of all three together as "all". Pools all
  /// scenarios of a part, and omits parts without scenarios.
  std::vector<std::pair<std::string, EvaluateRow>> pooled() const;
};

struct RobustOptions : DriverOptions {
  int scenarios = kRobustScenarios;  // per condition; only the default gives comparable results
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

/// Evaluates a driver in every condition that applies to it. Randomized cameras require images; impaired drivers
/// require observations; "carla" requires CARLA's towns in the map folder. Throws UsageError for a seed,
/// camera_severity, conditioning or lights other than the protocol's, and as evaluate() does.
RobustReport evaluate_robust(const RobustOptions& options);

}  // namespace pictura
