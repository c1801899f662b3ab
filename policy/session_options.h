// Options for opening a saved policy: its device, its cameras, and other differences from its training.
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
  std::string device = "auto";    // see run.device of configurations
  std::string simulator = "cpu";  // see simulator.backend of configurations
  std::string renderer, samples;  // see render.backend and render.samples; empty: as in training
  // Cameras that replace those of training; the number of cameras must be the same. They are those of a rig file or, if
  // width_px and height_px are not 0, the paper's cameras with this image size.
  std::string rig;
  int width_px = 0, height_px = 0;
  std::string backbone;  // path of the program policy.backbone; empty: the path in the policy's configuration
  // Values "name=value" that replace values in the table [evaluate.conditioning] of the policy's configuration.
  std::vector<std::string> conditioning;
  bool adds_walls = false;     // adds walls to the worlds, even if the policy was trained without walls
  bool average = false;        // uses the average of weights, which some checkpoints contain
  double camera_severity = 0;  // randomization of cameras as a multiple of kFullCameraSeverity
  int decision_steps = 0;      // number of steps for which an action is held; 0: as in training
  // Lights of the worlds; nullopt: as in training.
  std::optional<LightCycles> light_cycles;
  std::optional<LightHeads> light_heads;
};

/// Visits the options that callers can set by name, except those of visit_light_options().
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

/// Visits the options of lights. Commands for recorded scenes do not have these options.
template <typename Visitor>
void visit_light_options(SessionOptions& options, Visitor&& v) {
  v.choice({"light_cycles"}, options.light_cycles, {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.choice({"light_heads"}, options.light_heads, kLightHeadsNames);
}

}  // namespace pictura
