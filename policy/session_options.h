// Options for opening a saved policy: where it computes, its cameras, and differences from its training.
#pragma once

#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/support/named_option.h"
#include "pictura/map/map_geometry.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SessionOptions {
  int num_threads = 0;            // threads of torch and renderers; 0: all
  std::string device = "auto";    // as run.device of a configuration
  std::string simulator = "cpu";  // as simulator.backend; for the simulators in which the policy drives
  std::string renderer, samples;  // as render.backend and render.samples; empty: as in training
  // Cameras that replace the same number of cameras of training: those of a rig file, or the paper's cameras at another
  // size (0: as in training).
  std::string rig;
  int width_px = 0, height_px = 0;
  std::string backbone;  // path of the program of policy.backbone; empty: the path in the policy's configuration
  // Values that replace those of the policy's [evaluate.conditioning]: "name=value".
  std::vector<std::string> conditioning;
  bool adds_walls = false;     // adds walls to the policy's worlds, even if it was trained without walls
  bool average = false;        // uses the average of weights that a checkpoint may hold
  double camera_severity = 0;  // factor of kFullCameraSeverity by which cameras are randomized
  int decision_steps = 0;      // steps for which an action is held; 0: as in training (policy.decision_steps)
  // Lights of the policy's worlds; the lights of training if there is no value.
  std::optional<LightCycles> light_cycles;
  std::optional<LightHeads> light_heads;
};

/// Visits the options for opening a policy.
template <typename Visitor>
void visit_options(SessionOptions& options, Visitor&& v) {
  v.value({"num_threads"}, options.num_threads);
  v.value({"device"}, options.device);
  v.value({"simulator"}, options.simulator);
  v.value({"renderer"}, options.renderer);
  v.value({"samples"}, options.samples);
  v.value({"rig"}, options.rig);
  v.value({"width_px"}, options.width_px);
  v.value({"height_px"}, options.height_px);
  v.value({"backbone"}, options.backbone);
  v.numbers_by_name({"conditioning"}, options.conditioning);
  v.value({"average"}, options.average);
  v.value({"decision_steps"}, options.decision_steps);
  v.value({"camera_severity"}, options.camera_severity);
}

/// Visits the options of lights; worlds of recorded scenes lack these options.
template <typename Visitor>
void visit_light_options(SessionOptions& options, Visitor&& v) {
  v.choice({"light_cycles"}, options.light_cycles, {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.choice({"light_heads"}, options.light_heads, kLightHeadsNames);
}

}  // namespace pictura
