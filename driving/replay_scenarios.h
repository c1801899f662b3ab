// Drives scenarios of an evaluation again and records them.
#pragma once

#include <string>
#include <vector>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Scenario of an evaluation.
struct ScenarioPlace {
  size_t density = 0;  // index in the results
  int scenario = 0;    // number of the scenario
};

/// Returns the `count` worst scenarios, or all if there are fewer, the worst first. A scenario is worse if it has a
/// larger share of vehicles with an at-fault infraction. Ties are broken by more collisions at fault, then by less
/// distance driven.
std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count);

/// Scenario to drive again.
struct RecordedScenario {
  int number = 0;
  int agents_per_world = 0;
  std::string world_of;  // policy whose world configuration is used, as in probes; empty: the driver's own
};

/// A policy's takeover of `agent` after `step` steps of a scenario, for `steps` steps, while all other agents repeat
/// their motion. The takeover happens in the world configuration of RecordedScenario::world_of.
struct RecordedTakeover {
  std::string policy;
  bool untrained = false;  // has fresh weights
  int step = 0, agent = 0, steps = 0;
};

/// Drives a scenario again on the host, and records it. `counts_out` receives the scenario's counts. Floating-point
/// results differ in their last bits between batch sizes and devices, so a policy may drive differently than in its
/// evaluation.
Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out);

/// Drives a scenario again, on the host, and records it from the takeover on, up to its end or an infraction. Throws
/// Error if the scenario ends before the takeover.
Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording);

/// Write replays by record_scenario(): of the `count` worst scenarios into a folder with a gallery, or of the worst
/// scenario into one file. Report the files on stderr, and the counts that differ from the evaluation's counts.
void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder);
void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path);

}  // namespace pictura
