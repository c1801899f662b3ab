// Evaluation of a saved policy as in the Pictura paper.
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
/// Throws UsageError listing the names.
Density density_named(const std::string& name);

/// Number of the first evaluation world. Training worlds have smaller numbers.
constexpr uint32_t kFirstEvaluationWorld = 0x80000000u;

/// Observes the worlds of an evaluation. All batches of worlds run in the same simulator object.
class EvaluationObserver : public StepObserver {
 public:
  virtual void begin(Simulator& simulator) = 0;
  /// Called after all worlds of a batch are complete. Not called after an interrupt.
  virtual void end() {}
};

struct EvaluateOptions : DriverOptions {
  std::vector<std::string> maps;  // map names for load_map(); the paper uses eight towns
  std::vector<Density> densities{Density::light, Density::medium, Density::dense};
  int agents_per_world = 0;         // if > 0, replaces kDensityAgents
  std::vector<std::string> others;  // see evaluation/mixed_traffic.h
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
  // Counts of the completed densities. For each density, the evaluated driver precedes the other drivers.
  EvaluationResults results;
  std::vector<EvaluateRow> rows;  // one row per element of results.densities
  bool interrupted = false;       // an interrupt came before the last density was complete
  // seconds: wall time without loading maps and creating the renderer. agent_steps: steps of active agents. Both are 0
  // in a merged report.
  double seconds = 0;
  int64_t agent_steps = 0;
};

/// State shared by evaluations in the same worlds.
struct EvaluationWorlds {
  CompiledMaps maps;                     // compiled with the map options of the session's world
  Renderer* renderer = nullptr;          // for images, with maps under handles 0, 1, ...; null without images
  std::unique_ptr<Simulator> simulator;  // created by the first evaluation, as is maps_hash
  std::string maps_hash;
};

CompiledMaps compile_maps_of(const EvaluateOptions& options, const SimulatorConfig& world);

/// Evaluates the policy or controller of the options. Scenario k uses map k modulo the number of maps, and the random
/// numbers of world kFirstEvaluationWorld + k. Throws Error naming file and key for bad input.
EvaluateReport evaluate(const EvaluateOptions& options);
/// Evaluates with a session's policy, device, renderer and cameras.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options);
/// Evaluates in shared worlds. All evaluations in the same worlds need equal EvaluateOptions::steps.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options, EvaluationWorlds* worlds);
/// Evaluates options.controller in shared worlds.
EvaluateReport evaluate(const EvaluateOptions& options, EvaluationWorlds* worlds);

}  // namespace pictura
