// Evaluation in recorded scenes: the paper's zero-shot protocol and related protocols. Includes no torch headers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/evaluation/realism.h"
#include "pictura/evaluation/scene_results.h"
#include "pictura/evaluation/scene_rollouts.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

struct SceneEvaluateOptions : DriverOptions {
  std::vector<std::string> scenes;  // names of scenes for find_scenes(), evaluated in this order
  SceneProtocol protocol;
  int first_scene = 0, num_scenes = 0;  // range within the scenes found; num_scenes 0: all scenes from first_scene on
  bool hashes_scenes = false;           // whether to compute EvaluationSetting::maps_hash, which reads all scene files
  int scenes_at_once = 0;  // number of scenes simulated together; changes no result; 0: chosen for the device
  // Called for every driven road user, in the order of scenes, then densities, then rollouts, then tracks.
  std::function<void(const SceneAgent&)> on_agent;
  // Called for every scene that was simulated. If set, the protocol must satisfy check_rollouts().
  std::function<void(const SceneRollouts&)> on_rollouts;
  // Version of the realism score: one of realism_version_names(). Empty: rollouts are not scored. If set, the protocol
  // must satisfy check_rollouts().
  std::string realism;
  std::function<void(double done_fraction, double eta_s)> on_progress;
};

struct SceneEvaluation {
  SceneResults results;
  std::vector<SceneRow> rows;  // one per density of the protocol
  int found = 0;               // number of scenes to evaluate
  bool interrupted = false;    // an interrupt came; completed scenes are reported
  double seconds = 0;          // wall time, including the loading of scenes
  RealismReport realism;       // filled if options.realism is given

  /// Returns the scenes, files and trailing parts of files that are left out, with reasons.
  std::vector<std::string> faults() const;
};

/// Returns `config`, the configuration of an evaluation, with the protocol's settings and without the features that
/// recorded scenes lack.
SimulatorConfig protocol_config(const SceneProtocol& protocol, SimulatorConfig config);

/// Evaluates a driver in recorded scenes. Scenes that cannot be read or simulated are left out and reported. Throws
/// Error if there are no scenes or if no scene can be evaluated; UsageError for an invalid protocol.
SceneEvaluation evaluate_scenes(const SceneEvaluateOptions& options);

}  // namespace pictura
