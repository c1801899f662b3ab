// Evaluation of a saved policy, as the Pictura paper defines it. Includes no torch headers.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "pictura/common/portable/hd.h"
#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/evaluation/results.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

enum class Density { light, medium, dense };

constexpr std::array<const char*, 3> kDensityNames{"light", "medium", "dense"};
constexpr std::array<int, 3> kDensityAgents{60, 120, 150};
/// Returns the density of this name. Throws UsageError listing the names.
Density density_named(const std::string& name);

/// Global number of the first evaluation world. The numbers of training worlds begin at 0 and never reach this number.
constexpr uint32_t kFirstEvaluationWorld = 0x80000000u;

/// Observes the worlds of an evaluation during driving. All batches of worlds run in the same simulator object.
class EvaluationObserver : public StepObserver {
 public:
  /// Called at the start of the worlds' episodes.
  virtual void begin(Simulator& simulator) = 0;
  /// Called after all worlds of the batch are driven to the end. An interrupt ends the batch without this call.
  virtual void end() {}
};

struct EvaluateOptions : DriverOptions {
  std::vector<std::string> maps;  // names of maps for load_map(); the paper uses eight towns
  std::vector<Density> densities{Density::light, Density::medium, Density::dense};
  int agents_per_world = 0;         // > 0: replaces kDensityAgents
  std::vector<std::string> others;  // drivers of other vehicles, see evaluation/mixed_traffic.h
  int first_scenario = 0, scenarios = 200, steps = 3000;
  std::function<void(double done_fraction, double eta_s)> on_progress;
  EvaluationObserver* observer = nullptr;
};

template <typename Visitor>
void visit_options(EvaluateOptions& options, Visitor&& v) {
  v.value({"checkpoint"}, options.checkpoint);
  v.maps({"maps"}, options.maps);
  v.controller({"controller"}, options);
  v.choice({"densities"}, options.densities, kDensityNames);
  v.value({"agents_per_world"}, options.agents_per_world);
  v.numbers_by_name({"others"}, options.others);
  v.value({"first_scenario"}, options.first_scenario);
  v.value({"scenarios"}, options.scenarios);
  v.value({"steps"}, options.steps);
  visit_options(static_cast<DriverOptions&>(options), v);
  visit_light_options(options, v);
  v.callback({"on_progress"}, options.on_progress);
}

struct EvaluateReport {
  // Counts of the completed densities, in the order of options.densities. For each density, the counts of the evaluated
  // driver come first, then the counts of the other drivers.
  EvaluationResults results;
  std::vector<EvaluateRow> rows;  // one row per entry of results.densities
  bool interrupted = false;  // an interrupt (common/support/interrupt.h) came before the last density was completed
  // seconds: wall time without loading maps and creating the renderer. agent_steps: steps of active agents of all
  // classes. Both are 0 in a report that was merged from parts.
  double seconds = 0;
  int64_t agent_steps = 0;
};

/// State shared by evaluations in the same worlds.
struct EvaluationWorlds {
  CompiledMaps maps;             // EvaluateOptions::maps, compiled with the map options of the session's world
  Renderer* renderer = nullptr;  // for the session's images, with maps under handles 0, 1, ...; null without images
  std::unique_ptr<Simulator> simulator;  // created by the first evaluation
  std::string maps_hash;                 // value of EvaluationSetting::maps_hash; computed by the first evaluation
};

/// Compiles the options' maps for worlds of the configuration `world`.
CompiledMaps compile_maps_of(const EvaluateOptions& options, const SimulatorConfig& world);

/// Evaluates the policy or controller of the options. Scenario k uses map k modulo the number of maps, and draws random
/// numbers as world kFirstEvaluationWorld + k. So no scenario equals a training world, whatever the seeds. Throws Error
/// naming file and key for bad input.
EvaluateReport evaluate(const EvaluateOptions& options);
/// Evaluates a session's policy, with the session's own device, renderer and cameras.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options);
/// Evaluates a session's policy in shared worlds. All evaluations in the same worlds must have an equal number of
/// steps.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options, EvaluationWorlds* worlds);
/// Evaluates options.controller in shared worlds.
EvaluateReport evaluate(const EvaluateOptions& options, EvaluationWorlds* worlds);

}  // namespace pictura
