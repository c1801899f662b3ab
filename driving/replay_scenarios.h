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

/// Returns the scenarios with the largest share of vehicles with an at-fault infraction, worst first; `count` of them,
/// or all. Ties are broken by more collisions at fault, then by less distance driven.
std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count);

/// Scenario to drive again.
struct RecordedScenario {
  int number = 0;
  int agents_per_world = 0;
  std::string world_of;  // policy whose world is used, as in probes; empty: the driver's own
};

/// Policy that takes over one agent of a scenario after a number of its steps, for `steps` steps, while all other
/// agents repeat their motion. The scenario's world_of is its world.
struct RecordedTakeover {
  std::string policy;
  bool untrained = false;  // has fresh weights
  int step = 0, agent = 0, steps = 0;
};

/// Drives a scenario again, on the host, and records it. `counts_out` receives its counts. Floating-point results
/// depend on the batch size and on the device, so a policy may drive differently than in its evaluation.
Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out);

/// Drives a scenario again, on the host, and records it from the takeover on, up to its end or an infraction. Throws
/// Error if the scenario ends before the takeover.
Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording);

/// Writes replays as by record_scenario(): several into a folder with a gallery, or the worst scenario into one file.
/// Reports the files on stderr, and the counts that differ from the evaluation's.
void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder);
void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path);

}  // namespace pictura
