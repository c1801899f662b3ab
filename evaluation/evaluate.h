// The paper's evaluation of a saved policy, without torch headers.
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

/// Worlds of training are numbered from 0 and are never as many.
constexpr uint32_t kFirstEvaluationWorld = 0x80000000u;

/// Watches the worlds of an evaluation as they are driven; the simulator is the same object for each batch of worlds.
class EvaluationObserver : public StepObserver {
 public:
  /// Worlds at the start of their episode.
  virtual void begin(Simulator& simulator) = 0;
  /// All of these worlds are counted. Not called where an interrupt ends them.
  virtual void end() {}
};

struct EvaluateOptions : DriverOptions {
  std::vector<std::string> maps;  // as load_map takes them; the paper's eight towns
  std::vector<Density> densities{Density::light, Density::medium, Density::dense};
  int agents_per_world = 0;         // > 0: instead of the densities' own numbers
  std::vector<std::string> others;  // who else drives, as other_drivers() reads them; see evaluation/mixed_traffic.h
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
  // Counts of the finished densities, in the order of options.densities; for each density first the evaluated driver's,
  // then the others'.
  EvaluationResults results;
  std::vector<EvaluateRow> rows;  // of each
  bool interrupted = false;       // ^C came (common/support/interrupt.h) before the last one was
  // Without the making of maps and renderer, and 0 where parts were merged. Agent-steps are of active agents of all
  // classes.
  double seconds = 0;
  int64_t agent_steps = 0;
};

/// What evaluations in the same worlds share.
struct EvaluationWorlds {
  CompiledMaps maps;                     // of EvaluateOptions::maps, compiled with those options of the session's world
  Renderer* renderer = nullptr;          // of the session's images, with the maps as 0, 1, ...; null without images
  std::unique_ptr<Simulator> simulator;  // made by the first of them
  std::string maps_hash;                 // as EvaluationSetting's; computed by the first of them
};

/// The options' maps as a world of that configuration needs them.
CompiledMaps compile_maps_of(const EvaluateOptions& options, const SimulatorConfig& world);

/// Scenario k is on map k modulo the number of maps and draws its random numbers as world kFirstEvaluationWorld + k, so
/// that it repeats no world of training whatever the seeds. Throws Error naming file and key for bad input.
EvaluateReport evaluate(const EvaluateOptions& options);
/// The same of a session's policy, whose own device, renderer and cameras it keeps.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options);
/// One of several in the same worlds, with an equal number of steps.
EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options, EvaluationWorlds* worlds);
/// The same of options.controller.
EvaluateReport evaluate(const EvaluateOptions& options, EvaluationWorlds* worlds);

}  // namespace pictura
