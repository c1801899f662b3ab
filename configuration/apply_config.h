// Settings of cameras, renderers and simulators from a configuration.
#pragma once

#include "pictura/common/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the configuration after `agent_steps` agent-steps of a run, according to render.schedule.
Config config_at(const Config& config, int64_t agent_steps);

/// Returns the whole number by which both sides of `from` must be multiplied to get `to`, or 0.
int whole_factor(ImageSize from, ImageSize to);

/// Returns the rig after `agent_steps` agent-steps of a run.
Rig rig_of(const Config& config, int64_t agent_steps = 0);

/// Returns the renderer's settings. `rig` must come from rig_of(). `device` is the network's device.
RendererConfig renderer_config(const Config& config, const Rig& rig, Device device = {});

/// Returns the simulator's settings for training. Only a vector policy gets vector observations.
SimulatorConfig simulator_config(const Config& config, Device device = {});

/// Returns the simulator's settings for evaluation (paper, appendix, evaluation protocol). Episodes have exactly
/// `steps` steps.
SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device = {});

}  // namespace pictura
