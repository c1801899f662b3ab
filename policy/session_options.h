// How a saved policy is opened: what computes, its cameras, and what differs from its training.
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
  int num_threads = 0;            // of torch and renderers; 0: all
  std::string device = "auto";    // as run.device of a configuration
  std::string simulator = "cpu";  // as simulator.backend: of the simulators that it drives in
  std::string renderer, samples;  // as render.backend and render.samples; empty: as the policy was trained
  // Cameras other than those of training, as many: a rig file, or the paper's at another size (0: as trained).
  std::string rig;
  int width_px = 0, height_px = 0;
  std::string backbone;  // where the program of policy.backbone lies now; empty: where it did
  // Of [evaluate.conditioning], in place of the policy's own: "name=value".
  std::vector<std::string> conditioning;
  bool adds_walls = false;     // its worlds have walls, also where it was trained without
  bool average = false;        // drives with the average of weights that a checkpoint holds
  double camera_severity = 0;  // its cameras are randomized by kFullCameraSeverity times this
  int decision_steps = 0;      // steps for which an action is held; 0: as in training (policy.decision_steps)
  // Lights of its worlds; without a value those that the policy was trained with.
  std::optional<LightCycles> light_cycles;
  std::optional<LightHeads> light_heads;
};

/// Visits the options of how a policy is opened.
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

/// Visits the options of lights, which worlds of recorded scenes do not have.
template <typename Visitor>
void visit_light_options(SessionOptions& options, Visitor&& v) {
  v.choice({"light_cycles"}, options.light_cycles, {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.choice({"light_heads"}, options.light_heads, kLightHeadsNames);
}

}  // namespace pictura
