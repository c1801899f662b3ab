// Derives the settings of cameras, renderers and simulators from a configuration.
#pragma once

#include "pictura/common/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the configuration that applies after `agent_steps` agent-steps of a run. Image sizes, policy.patch_px and
/// render.line_floor_px follow render.schedule.
Config config_at(const Config& config, int64_t agent_steps);

/// Returns the whole number by which both the width and the height of `from` must be multiplied to get `to`, or 0 if
/// there is no such number.
int whole_factor(ImageSize from, ImageSize to);

/// Returns the rig (cameras) of the render section after `agent_steps` agent-steps of a run.
Rig rig_of(const Config& config, int64_t agent_steps = 0);

/// Returns the settings of the renderer: `rig`, which must come from rig_of(), and all other image settings. `device`
/// is the network's device.
RendererConfig renderer_config(const Config& config, const Rig& rig, Device device = {});

/// Returns the settings of the simulator for training. Vector observations are only enabled for a vector policy.
SimulatorConfig simulator_config(const Config& config, Device device = {});

/// Returns the settings of the simulator for evaluation (paper, appendix, evaluation protocol): episodes of exactly
/// `steps` steps, fixed conditioning, and fixed light cycles.
SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device = {});

}  // namespace pictura
