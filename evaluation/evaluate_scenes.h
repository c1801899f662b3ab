// Evaluation in recorded scenes: the paper's zero-shot protocol and its relatives. Without torch headers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/evaluation/scene_protocol.h"
#include "pictura/evaluation/scene_results.h"
#include "pictura/evaluation/scene_rollouts.h"

namespace pictura {

struct SceneEvaluateOptions : DriverOptions {
  std::vector<std::string> scenes;  // as find_scenes() takes them; one after the other
  SceneProtocol protocol;
  int first_scene = 0, num_scenes = 0;  // of all that are found; 0: all from the first on
  bool hashes_scenes = false;           // the setting has maps_hash, for which the files of all scenes are read
  int scenes_at_once = 0;               // that are simulated together, which changes no figure; 0: as the device needs
  // For every driven road user: scene by scene, density by density, rollout by rollout, in the order of the tracks.
  std::function<void(const SceneAgent&)> on_agent;
  // For every scored scene; the protocol must be what check_rollouts() demands.
  std::function<void(const SceneRollouts&)> on_rollouts;
  std::function<void(double done_fraction, double eta_s)> on_progress;
};

struct SceneEvaluation {
  SceneResults results;
  std::vector<SceneRow> rows;  // by the densities of the protocol
  int found = 0;               // scenes that there were to evaluate
  bool interrupted = false;    // ^C came; what is finished is reported
  double seconds = 0;          // with the loading of scenes

  /// Scenes, files and ends of files that are left out, and why.
  std::vector<std::string> faults() const;
};

/// A world's configuration as a protocol has it: `config`, that of an evaluation, without what scenes have none of.
SimulatorConfig protocol_config(const SceneProtocol& protocol, SimulatorConfig config);

/// Scenes that cannot be read or simulated are left out and told. Throws Error where not one is left, or when there are
/// none; UsageError for a protocol that cannot be.
SceneEvaluation evaluate_scenes(const SceneEvaluateOptions& options);

}  // namespace pictura
