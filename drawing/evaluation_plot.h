// Evaluations along trainings: a panel a metric of the protocol, a line a training, and its densities as a band.
#pragma once

#include <string>
#include <vector>

#include "pictura/drawing/run_plot.h"

namespace pictura {

/// Returns panels of at-fault collisions, off-road, red lights, goals and distance per infraction over the agent-steps
/// or hours (of one GPU) of trainings; of distances per infraction and per at-fault infraction those that rows have. A
/// line is medium traffic, its band reaches from the lowest to the highest density. `path`: {"lines": [{"name": TEXT,
/// "dashed": BOOL, "points": [{"agent_steps": N, "gpu_hours": N, "rows": ROWS}]}]}, where ROWS are those of `pictura
/// evaluate --json`, one of them medium. Throws Error naming the file, the line and what is missing there.
std::vector<PlotPanel> plot_evaluations(const std::string& path, RunAxis axis);

}  // namespace pictura
