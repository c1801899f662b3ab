// Options for opening a saved policy.
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
  std::string device = "auto";    // see run.device
  std::string simulator = "cpu";  // see simulator.backend
  std::string renderer, samples;  // see render.*; empty: as in training
  // Cameras instead of those of training: a rig file, or the paper's cameras with this image size. Their number must be
  // the same.
  std::string rig;
  int width_px = 0, height_px = 0;
  std::string backbone;  // program policy.backbone; empty: as in training
  // Values "name=value" for the table [evaluate.conditioning].
  std::vector<std::string> conditioning;
  bool adds_walls = false;     // adds walls to worlds without walls
  bool average = false;        // uses averaged weights, which some checkpoints contain
  double camera_severity = 0;  // camera randomization in units of kFullCameraSeverity
  int decision_steps = 0;      // steps that hold an action; 0: as in training
  // Lights of the worlds; nullopt: as in training.
  std::optional<LightCycles> light_cycles;
  std::optional<LightHeads> light_heads;
};

/// Visits the named options, except lights.
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

/// Visits the options of lights, which commands for recorded scenes lack.
template <typename Visitor>
void visit_light_options(SessionOptions& options, Visitor&& v) {
  v.choice({"light_cycles"}, options.light_cycles, {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.choice({"light_heads"}, options.light_heads, kLightHeadsNames);
}

}  // namespace pictura
