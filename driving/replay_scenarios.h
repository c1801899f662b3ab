// Simulates scenarios of an evaluation again, and records them.
#pragma once

#include <string>
#include <vector>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

struct ScenarioPlace {
  size_t density = 0;  // index in the results
  int scenario = 0;    // scenario number
};

/// Returns up to `count` scenarios, the worst first. Compares the share of vehicles with an at-fault infraction, then
/// the share of at-fault collisions, then the distance (shorter is worse).
std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count);

struct RecordedScenario {
  int number = 0;
  int agents_per_world = 0;
  // Policy whose world configuration is used. Empty: the driver's.
  std::string world_of;
};

/// After `step` steps of a scenario, a policy drives `agent` for `steps` steps. All other agents move as they did
/// without the takeover. The steps before the takeover use the world configuration of RecordedScenario::world_of.
struct RecordedTakeover {
  std::string policy;
  bool untrained = false;  // new random weights
  int step = 0, agent = 0, steps = 0;
};

/// Simulates a scenario again on the host. A policy may drive differently than in its evaluation, because
/// floating-point results depend on batch size and device. agent_of_out: as in Recorder::finish().
Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out,
                       std::vector<int32_t>* agent_of_out = nullptr);

/// Records a scenario from the takeover on, until its steps are done or its agent has an infraction. Throws Error if
/// the scenario ends before the takeover.
Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording);

/// Writes the `count` worst scenarios and a gallery into a folder. Reports the files on stderr, and the counts that
/// differ from the evaluation's.
void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder);
/// Writes the worst scenario into one file, and reports as write_scenario_replays() does.
void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path);

}  // namespace pictura
