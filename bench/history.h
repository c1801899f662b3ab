// Times drawing random agents of random steps out of a scene history against drawing agents of the present scene, and
// compares images out of the history with those that were drawn at the time.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct HistoryCase {
  std::string backend = "cpu";  // of simulator and renderer: cpu, or cuda with both and the history on the first device
  SimulatorConfig simulator;
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  Rig rig = paper_rig();
  int warm_up_steps = 60, num_steps = 128;  // with random actions: before the history begins, and in it
  int num_views = 8192;                     // of a call
  int checked_images = 8;                   // views of as many steps, compared before and after timing
  int repeats = 7;
  double repeat_s = 1.0;  // approximate duration of the calls of a repeat, of each of the two kinds
};

struct HistoryMeasurement {
  std::string choice;                          // as reported by make_renderer()
  std::vector<double> present_ms, history_ms;  // one per repeat, by turns: the mean of its calls
  double history_bytes = 0;
};

/// A call of the present draws that many random agents of the last step; one of the history gathers and draws that many
/// random pairs of step and agent. Absent agents are left out of both. Throws Error where an image out of the history
/// is not the one that was drawn at the time, value for value, or a backend cannot run here.
HistoryMeasurement measure_history(const HistoryCase& history_case);

}  // namespace pictura
