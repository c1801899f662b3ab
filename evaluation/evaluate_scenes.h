// Evaluation in recorded scenes, by the paper's zero-shot protocol and variants.
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
  std::vector<std::string> scenes;  // scene names for find_scenes(), evaluated in this order
  SceneProtocol protocol;
  int first_scene = 0, num_scenes = 0;  // range of scenes; num_scenes 0: all from first_scene on
  bool hashes_scenes = false;           // computes EvaluationSetting::maps_hash from all files
  int scenes_at_once = 0;               // changes no result; 0: chosen for the device
  // Called for each driven road user, ordered by scene, density, rollout and track.
  std::function<void(const SceneAgent&)> on_agent;
  // Called for each scene. Requires a protocol that satisfies check_rollouts().
  std::function<void(const SceneRollouts&)> on_rollouts;
  // One of realism_version_names(), or empty for no score. A version requires a protocol that satisfies
  // check_rollouts().
  std::string realism;
  std::function<void(double done_fraction, double eta_s)> on_progress;
};

struct SceneEvaluation {
  SceneResults results;
  std::vector<SceneRow> rows;
  int found = 0;             // scenes to evaluate
  bool interrupted = false;  // completed scenes are reported
  double seconds = 0;        // wall time, including loading
  RealismReport realism;     // filled if a realism version is given

  /// Returns excluded scenes, and files that are unreadable wholly or from some point on, with reasons.
  std::vector<std::string> faults() const;
};

/// Returns `config` with the protocol's settings, without features that recorded scenes lack.
SimulatorConfig protocol_config(const SceneProtocol& protocol, SimulatorConfig config);

/// Evaluates a driver. Excludes and reports scenes that cannot be read or simulated. Throws Error if no scene remains,
/// UsageError for an invalid protocol.
SceneEvaluation evaluate_scenes(const SceneEvaluateOptions& options);

}  // namespace pictura
