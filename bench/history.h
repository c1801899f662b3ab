// Times of drawing random agents' views from a scene history and from the current scene.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct HistoryCase {
  std::string backend = "cpu";  // cpu; or cuda, with the history on the first device
  SimulatorConfig simulator;
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  Rig rig = paper_rig();
  int warm_up_steps = 60, num_steps = 128;  // random steps before the history, and in the history
  int num_views = 8192;                     // per call
  int checked_images = 8;                   // images of different steps, checked before and after timing
  int repeats = 7;
  double repeat_s = 1.0;  // approximate, for each kind of call
};

struct HistoryMeasurement {
  std::string choice;                          // as reported by make_renderer()
  std::vector<double> present_ms, history_ms;  // [repeat] mean time of a call
  double history_bytes = 0;
};

/// A call for the current scene draws num_views random agents' views. A call for the history gathers and draws
/// num_views random pairs of a step and an agent. Throws Error if an image from the history differs from the image of
/// its step, or if a backend cannot run on this machine.
HistoryMeasurement measure_history(const HistoryCase& history_case);

}  // namespace pictura
