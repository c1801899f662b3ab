// Robust protocol: one table of a driver's performance in generated towns, among other drivers, and with randomized
// cameras. Everything but the driver is fixed, so that numbers of different drivers are comparable. Has no torch
// headers.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

constexpr const char* kRobustProtocol = "robust";  // name in commands
constexpr int kRobustScenarios = 24;               // per condition
constexpr int kRobustSteps = 1200;                 // steps of 0.1 s
constexpr uint64_t kRobustSeed = 1;

/// Worlds of one row of the table.
struct RobustCondition {
  std::string part;                 // "towns", "carla", "others" or "cameras"
  std::string name;                 // unique
  std::vector<std::string> maps;    // as load_map() takes them
  int agents_per_world = 0;         // agents of all classes
  std::vector<std::string> others;  // as other_drivers() takes them
  double camera_severity = 0;       // as SessionOptions::camera_severity
};

/// Returns the conditions in the order of the table. The first condition is the reference with which all others are
/// compared.
const std::vector<RobustCondition>& robust_conditions();

/// Metrics of the evaluated driver in one condition.
struct RobustRow {
  RobustCondition condition;
  DensityResult counts;    // has no scenarios if the condition does not apply
  std::string not_driven;  // reason for which the condition does not apply to the driver; empty if it applies
};

struct RobustReport {
  EvaluationSetting setting;  // setting of the first condition
  std::vector<RobustRow> rows;
  bool interrupted = false;  // an interrupt came; completed conditions are reported
  double seconds = 0;
  int64_t agent_steps = 0;

  /// Returns the metrics of a row's scenarios.
  EvaluateRow metrics(const RobustRow& row) const;
  /// Returns metrics by the names "towns", "others", "cameras" and "all", each over the scenarios of its part's rows;
  /// "all" leaves out "carla", whose files users must supply. Parts that were not driven are left out.
  std::vector<std::pair<std::string, EvaluateRow>> pooled() const;
};

struct RobustOptions : DriverOptions {
  int scenarios = kRobustScenarios;  // per condition; results of another number than the default are not comparable
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

/// Evaluates a driver in every condition that applies to it. Conditions with randomized cameras apply to policies that
/// read images, conditions with impaired drivers to drivers that read observations, and "carla" if the map folder holds
/// the eight towns. Throws UsageError for a seed, camera_severity, conditioning or lights other than the protocol's;
/// otherwise throws as evaluate() does.
RobustReport evaluate_robust(const RobustOptions& options);

}  // namespace pictura
