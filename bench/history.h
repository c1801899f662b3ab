// Time of drawing random agents of random steps from a scene history, compared with drawing agents of the current
// scene. Images from the history are compared with images drawn at the time of the step.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct HistoryCase {
  std::string backend = "cpu";  // simulator and renderer: cpu, or cuda with both and the history on the first device
  SimulatorConfig simulator;
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  Rig rig = paper_rig();
  int warm_up_steps = 60, num_steps = 128;  // steps with random actions before and in the history
  int num_views = 8192;                     // per call
  int checked_images = 8;                   // views of as many different steps, compared before and after timing
  int repeats = 7;
  double repeat_s = 1.0;  // approximate duration of a repeat, for each of the two kinds of calls
};

struct HistoryMeasurement {
  std::string choice;                          // as reported by make_renderer()
  std::vector<double> present_ms, history_ms;  // one per repeat, alternating: the mean of its calls
  double history_bytes = 0;
};

/// Measures both kinds of calls. A call of the current scene draws num_views random agents of the last step. A call of
/// the history gathers and draws as many random pairs of step and agent. Neither call draws absent agents. Throws Error
/// if an image from the history differs in any value from the image drawn at the time of the step, or if a backend
/// cannot run on this machine.
HistoryMeasurement measure_history(const HistoryCase& history_case);

}  // namespace pictura
