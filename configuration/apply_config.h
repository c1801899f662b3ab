// Settings of cameras, renderers and simulators that a configuration gives.
#pragma once

#include "pictura/common/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// The configuration in force after `agent_steps`: sizes, policy.patch_px and render.line_floor_px are those of
/// render.schedule.
Config config_at(const Config& config, int64_t agent_steps);

/// How many times as wide and as high as `from` the size `to` is, where that is one whole number, else 0.
int whole_factor(ImageSize from, ImageSize to);

/// The rig that render describes for a run that has done `agent_steps`.
Rig rig_of(const Config& config, int64_t agent_steps = 0);

/// Settings of the renderer: everything about an image that the policy depends on, with a rig of its run. `device` is
/// where the network computes.
RendererConfig renderer_config(const Config& config, const Rig& rig, Device device = {});

/// Settings of the simulator for training: entity sets only for the vector modality.
SimulatorConfig simulator_config(const Config& config, Device device = {});

/// Settings of the simulator for evaluation (paper, appendix, evaluation protocol): episodes of `steps` that nothing
/// ends early, fixed conditioning, fixed lights.
SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device = {});

}  // namespace pictura
