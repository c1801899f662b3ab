// Evaluation in recorded scenes: the paper's zero-shot protocol and related protocols. Has no torch headers.
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
  std::vector<std::string> scenes;  // as find_scenes() takes them, in this order
  SceneProtocol protocol;
  int first_scene = 0, num_scenes = 0;  // range within the scenes found; num_scenes 0: all scenes from first_scene on
  bool hashes_scenes = false;  // fills maps_hash of the setting, which requires reading the files of all scenes
  int scenes_at_once = 0;      // scenes simulated together, which changes no result; 0: chosen for the device
  // Called for every driven road user: scene by scene, density by density, rollout by rollout, in the order of the
  // tracks.
  std::function<void(const SceneAgent&)> on_agent;
  // Called for every scored scene; the protocol must satisfy check_rollouts().
  std::function<void(const SceneRollouts&)> on_rollouts;
  // Name of the version by which rollouts are scored, one of realism_version_names(); the protocol must then satisfy
  // check_rollouts(), too. Empty: rollouts are not scored.
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

/// World configuration of a protocol: `config`, an evaluation's configuration, without features that recorded scenes
/// lack.
SimulatorConfig protocol_config(const SceneProtocol& protocol, SimulatorConfig config);

/// Evaluates a driver in recorded scenes. Scenes that cannot be read or simulated are left out and reported. Throws
/// Error if there are no scenes or if no scene can be evaluated; UsageError for an invalid protocol.
SceneEvaluation evaluate_scenes(const SceneEvaluateOptions& options);

}  // namespace pictura
