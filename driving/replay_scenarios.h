// Scenarios of an evaluation driven again, and recorded.
#pragma once

#include <string>
#include <vector>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// A scenario of an evaluation.
struct ScenarioPlace {
  size_t density = 0;  // of the results
  int scenario = 0;    // its number
};

/// The scenarios with the largest share of vehicles with an at-fault infraction, worst first; `count` of them, or all.
/// Ties are broken by more collisions at fault, then by less distance driven.
std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count);

/// A scenario to drive again.
struct RecordedScenario {
  int number = 0;
  int agents_per_world = 0;
  std::string world_of;  // the policy whose world it is in, as probes have it; empty: the driver's own
};

/// A policy that takes over one agent of a scenario after so many of its steps, for `steps` of them, while all others
/// go where they went. world_of of the scenario is its world.
struct RecordedTakeover {
  std::string policy;
  bool untrained = false;  // it has fresh weights
  int step = 0, agent = 0, steps = 0;
};

/// Drives a scenario again, on the host, and records it. `counts_out` receives what it counted: floating point gives
/// other bits in batches of other sizes and on devices, so that a policy may drive it otherwise than it was evaluated.
Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out);

/// Drives a scenario again, on the host, and records what follows from the takeover on, or up to where an infraction
/// ends it. Throws Error where the scenario is over before.
Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording);

/// As record_scenario() does, into files of a folder, with its gallery, or the worst one into one file. Says on stderr
/// what it writes, and which counts differ from the evaluation's.
void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder);
void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path);

}  // namespace pictura
