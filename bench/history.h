// Measures how long it takes to draw views of random agents, from random steps of a scene history and from the current
// scene. Also checks that images from the history equal the images that were drawn during the step.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct HistoryCase {
  std::string backend = "cpu";  // simulator and renderer: cpu; or cuda, with the history on the first device
  SimulatorConfig simulator;
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  Rig rig = paper_rig();
  int warm_up_steps = 60, num_steps = 128;  // steps with random actions: before the history, and in the history
  int num_views = 8192;                     // views per call
  int checked_images = 8;                   // number of checked images, from different steps, before and after timing
  int repeats = 7;
  double repeat_s = 1.0;  // approximate duration of a repeat of each of the two kinds of calls
};

struct HistoryMeasurement {
  std::string choice;                          // as reported by make_renderer()
  std::vector<double> present_ms, history_ms;  // mean of the calls of each repeat; the kinds of calls alternate
  double history_bytes = 0;
};

/// Measures both kinds of calls. A call for the current scene draws the views of num_views random agents of the last
/// step. A call for the history gathers and draws num_views random pairs of a step and an agent. Neither call draws
/// absent agents. Throws Error if an image from the history differs in any value from the image that was drawn during
/// the step, or if a backend cannot run on this machine.
HistoryMeasurement measure_history(const HistoryCase& history_case);

}  // namespace pictura
