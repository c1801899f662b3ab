#include "pictura/training/run.h"

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

std::unique_ptr<Simulator> make_training_simulator(const Config& config, Device device) {
  const Config::SimulatorSection& section = config.simulator;
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& name : section.maps) maps.push_back(load_map(name));
  const int num_maps = static_cast<int>(maps.size());
  return make_simulator(
      config.simulator.backend, simulator_config(config, device), std::move(maps),
      draw_worlds(config.run.seed, section.num_slots, section.min_agents, section.max_agents, num_maps));
}

std::unique_ptr<Renderer> make_training_renderer(const Config& config, const Rig& rig, const Simulator& simulator) {
  if (!config.reads_images()) return nullptr;
  std::unique_ptr<Renderer> renderer =
      make_renderer(config.render.backend, renderer_config(config, rig, simulator.device()));
  upload_maps(simulator, renderer.get());
  return renderer;
}

}  // namespace

Run::Run(const Config& its_config, Device its_device)
    : config(its_config),
      device(its_device),
      rig(rig_of(config)),
      simulator(make_training_simulator(config, device)),
      renderer(make_training_renderer(config, rig, *simulator)),
      executor(make_learner_executor(device)),
      timer(device),
      policy(make_policy(config, rig, device)),
      optimizer(policy, config.train),
      rollout(RolloutObservations(config, simulator.get(), renderer.get(), &timer), config.train.num_steps,
              simulator->num_slots(), device) {}

void Run::save(const std::string& path, const std::vector<RecentUpdate>& recent) const {
  Checkpoint checkpoint;
  checkpoint.config = config;
  checkpoint.rig = rig;
  checkpoint.update = update;
  checkpoint.agent_steps = agent_steps;
  checkpoint.distance_m = distance_m;
  checkpoint.adam_steps = optimizer.steps;
  checkpoint.filter_average = filter.average;
  checkpoint.recent = recent;
  checkpoint.longest_update_s = longest_update_s;
  checkpoint.parameters = policy.parameters();
  checkpoint.first_moments = optimizer.first_moments;
  checkpoint.second_moments = optimizer.second_moments;
  checkpoint.simulator = simulator->save();
  write_checkpoint(path, checkpoint);
}

std::string Run::restore(const Checkpoint& saved) {
  const std::string difference = first_difference(saved.config, config);
  PICTURA_CHECK(difference.empty(), "{}: saved under another configuration: {}", saved.path, difference);
  const std::string rig_difference = config.reads_images() ? first_difference(saved.rig, rig) : "";
  PICTURA_CHECK(rig_difference.empty(), "{}: saved with other cameras than {} has: {}", saved.path,
                config.render.rig.empty() ? "the paper's rig" : config.render.rig, rig_difference);
  restore_tensors(saved, saved.parameters, policy.parameters());
  restore_tensors(saved, saved.first_moments, optimizer.first_moments);
  restore_tensors(saved, saved.second_moments, optimizer.second_moments);
  optimizer.steps = saved.adam_steps;
  filter.average = saved.filter_average;
  update = saved.update;
  agent_steps = saved.agent_steps;
  distance_m = saved.distance_m;
  longest_update_s = saved.longest_update_s;
  try {
    simulator->restore(saved.simulator);
  } catch (const Error& error) {
    simulator->reset();
    return error.what();
  }
  return "";
}

}  // namespace pictura
