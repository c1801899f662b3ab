#include "pictura/configuration/apply_config.h"

namespace pictura {

Config config_at(const Config& config, int64_t agent_steps) {
  Config result = config;
  for (const RenderSection::SizeChange& change : config.render.schedule) {
    if (change.agent_steps > agent_steps) break;
    result.render.width_px = change.width_px;
    result.render.height_px = change.height_px;
    if (!change.has_patches()) continue;
    result.policy.patch_px = change.patch_px;
    result.render.line_floor_px = change.line_floor_px;
  }
  return result;
}

int whole_factor(ImageSize from, ImageSize to) {
  const int factor = to.width_px / from.width_px;
  return to == ImageSize{factor * from.width_px, factor * from.height_px} ? factor : 0;
}

Rig rig_of(const Config& config, int64_t agent_steps) {
  if (!config.render.rig.empty()) return load_rig(config.render.rig);
  const Config in_force = config_at(config, agent_steps);
  return paper_rig(in_force.render.width_px, in_force.render.height_px);
}

RendererConfig renderer_config(const Config& config, const Rig& rig, Device device) {
  RendererConfig result;
  result.device = device;
  result.rig = rig;
  result.num_threads = config.run.num_threads;
  result.line_floor_px = static_cast<float>(config.render.line_floor_px);
  result.samples = config.render.samples;
  result.randomization = config.render.randomization;
  result.randomization.seed = config.run.seed;
  return result;
}

SimulatorConfig simulator_config(const Config& config, Device device) {
  SimulatorConfig result = config.simulator;
  result.device = device;
  result.seed = config.run.seed;
  result.num_threads = config.run.num_threads;
  result.stagger_episodes = config.train.stagger_episodes;
  for (size_t i = 0; i < config.simulator.other_policies.size(); ++i) {
    result.others.policies[i] = static_cast<float>(parse_share(config.simulator.other_policies[i])->share);
  }
  result.vector_observations = config.policy.modality == Modality::vector;
  result.auxiliary_observations = result.vector_observations && config.policy.auxiliary;
  return result;
}

SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device) {
  SimulatorConfig result = simulator_config(config, device);
  result.episode_steps = steps;
  result.reset_inactive_fraction = 2;
  result.stagger_episodes = false;
  result.fixed_lights = true;
  result.others = {};
  for (size_t i = 0; i < result.conditioning.size(); ++i) {
    const auto value = static_cast<float>(config.evaluate.conditioning[i]);
    result.conditioning[i] = {value, value, false};
  }
  return result;
}

}  // namespace pictura
