// Settings of cameras, renderers and simulators from a configuration.
#pragma once

#include "pictura/common/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the configuration in force after `agent_steps`, with sizes, policy.patch_px and render.line_floor_px from
/// render.schedule.
Config config_at(const Config& config, int64_t agent_steps);

/// Returns the whole number by which `to` is wider and higher than `from`; 0 if there is none.
int whole_factor(ImageSize from, ImageSize to);

/// Returns the rig of the render section for a run after `agent_steps`.
Rig rig_of(const Config& config, int64_t agent_steps = 0);

/// Returns the settings of the renderer: all image settings that the policy depends on, and `rig`, a rig of the
/// configuration's run. `device` is the network's device.
RendererConfig renderer_config(const Config& config, const Rig& rig, Device device = {});

/// Returns the settings of the simulator for training, with entity sets only for the vector modality.
SimulatorConfig simulator_config(const Config& config, Device device = {});

/// Returns the settings of the simulator for evaluation (paper, appendix, evaluation protocol): episodes of `steps`
/// that nothing ends early, fixed conditioning, fixed lights.
SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device = {});

}  // namespace pictura
