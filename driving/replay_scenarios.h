// Simulates scenarios of an evaluation again, and records them.
#pragma once

#include <string>
#include <vector>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// A scenario of an evaluation.
struct ScenarioPlace {
  size_t density = 0;  // index in the results
  int scenario = 0;    // number of the scenario
};

/// Returns the `count` worst scenarios (or all if there are fewer), the worst first. A scenario is worse if a larger
/// share of its vehicles has an infraction at fault. If these shares are equal, a larger share of collisions at fault
/// is worse, and then a shorter distance driven.
std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count);

/// A scenario to simulate again.
struct RecordedScenario {
  int number = 0;
  int agents_per_world = 0;
  // Policy whose world configuration is used, as in probes. If empty, the driver's own configuration is used.
  std::string world_of;
};

/// A takeover: after `step` steps of a scenario, a policy drives `agent` for `steps` steps, while all other agents
/// repeat their motion. The steps before the takeover use the world configuration of RecordedScenario::world_of.
struct RecordedTakeover {
  std::string policy;
  bool untrained = false;  // the policy has new random weights
  int step = 0, agent = 0, steps = 0;
};

/// Simulates a scenario again on the host, and records it. `counts_out` receives the scenario's counts. A policy may
/// drive differently than in its evaluation, because floating-point results differ in their last bits between batch
/// sizes and devices.
Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out);

/// Simulates a scenario again on the host, and records it from the takeover on. The recording ends after the takeover's
/// steps, or with an infraction of its agent. Throws Error if the scenario ends before the takeover.
Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording);

/// Uses record_scenario() to write replays of the `count` worst scenarios into a folder with a gallery. Reports on
/// stderr the files, and any counts that differ from the evaluation's.
void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder);
/// Writes a replay of the worst scenario into one file, and reports as write_scenario_replays() does.
void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path);

}  // namespace pictura
