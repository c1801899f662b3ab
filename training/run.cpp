#include "pictura/training/run.h"

#include <ATen/core/grad_mode.h>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/network_shape.h"
#include "pictura/simulator/saved_worlds.h"
#include "pictura/training/patch_growth.h"
#include "pictura/training/ranks/agree.h"
#include "pictura/training/schedule.h"
#include "pictura/training/training_maps.h"

namespace pictura {

namespace {

std::unique_ptr<Teacher> make_teacher(const Config& config, Device device, Communicator* communicator) {
  const std::string& path = config.train.teacher;
  if (path.empty()) return nullptr;
  return std::make_unique<Teacher>(parse_policy(file_of_first(path, communicator), path), config, device);
}

std::unique_ptr<Opponents> make_opponents(const Config& config, Device device, Communicator* communicator) {
  if (config.simulator.other_policies.empty()) return nullptr;
  return std::make_unique<Opponents>(config, device, communicator);
}

SimulatorConfig observed_world(const Config& config, Device device, const Teacher* teacher,
                               const Opponents* opponents) {
  SimulatorConfig world = training_world(config, device);
  if (teacher) teacher->add_arrays(&world);
  if (opponents) opponents->add_arrays(&world);
  return world;
}

std::unique_ptr<SceneSets> make_scene_sets(const Config& config, const SimulatorConfig& world,
                                           std::vector<WorldSpec> worlds, size_t num_all_worlds) {
  if (!config.simulator.has_scenes()) return nullptr;
  return std::make_unique<SceneSets>(config, world, std::move(worlds), static_cast<int>(num_all_worlds));
}

std::unique_ptr<Simulator> make_training_simulator(const Config& config, const SimulatorConfig& world,
                                                   SceneSets* scenes, std::vector<WorldSpec> worlds) {
  if (scenes) {
    SceneSet first = scenes->take(0);
    return make_simulator(config.simulator.backend, world, std::move(first.maps), std::move(first.worlds));
  }
  return make_simulator(config.simulator.backend, world, load_maps(training_maps(config), config.run.num_threads),
                        std::move(worlds));
}

std::unique_ptr<Renderer> make_training_renderer(const Config& config, const Rig& rig, const Simulator& simulator) {
  if (!config.reads_images()) return nullptr;
  std::unique_ptr<Renderer> renderer =
      make_renderer(config.render.backend, renderer_config(config, rig, simulator.device()));
  upload_maps(simulator, renderer.get());
  return renderer;
}

// Whether work is captured into graphs. A backbone program may do work that graphs cannot contain, and OpenGL's drawing
// is not CUDA work.
bool uses_graphs(const Config& config, Device device, const Renderer* renderer) {
  return config.train.graphs == "auto" && !device.is_host() && (!renderer || renderer->name() == "cuda") &&
         config.policy.backbone == "conv";
}

// Throws Error if settings of two networks differ. Some of them change no parameters, and an error about shapes would
// not name the setting.
void check_network_settings(const SavedPolicy& other, const Config& config,
                            std::initializer_list<std::pair<const char*, bool PolicySection::*>> settings) {
  for (const auto& [key, setting] : settings) {
    const bool got = other.config.policy.*setting, expected = config.policy.*setting;
    PICTURA_CHECK(got == expected, "{}: has a different architecture: {}: expected {}, got {}", other.path, key,
                  expected, got);
  }
}

}  // namespace

Run::Run(const Config& its_config, Device its_device, Communicator* its_communicator,
         std::unique_ptr<const Policy> its_policy)
    : config(its_config),
      in_force(config),
      device(its_device),
      communicator(its_communicator),
      all_worlds(draw_training_worlds(config)),
      rig(rig_of(config)),
      teacher(make_teacher(config, device, communicator)),
      opponents(make_opponents(config, device, communicator)),
      world(observed_world(config, device, teacher.get(), opponents.get())),
      scenes(make_scene_sets(config, world, worlds_in_part(all_worlds, communicator->rank(), communicator->size()),
                             all_worlds.size())),
      simulator(make_training_simulator(config, world, scenes.get(),
                                        worlds_in_part(all_worlds, communicator->rank(), communicator->size()))),
      renderer(make_training_renderer(config, rig, *simulator)),
      executor(make_learner_executor(device)),
      timer(device),
      policy(its_policy ? std::move(its_policy) : make_policy(config, rig, device)),
      optimizer(*policy, config.train, device, uses_graphs(config, device, renderer.get())),
      rollout(RolloutObservations(config, simulator.get(), renderer.get(), &timer), config.train.num_steps,
              simulator->num_slots(), device),
      stream(uses_graphs(config, device, renderer.get()) ? std::optional<OwnStream>(device) : std::nullopt),
      graphs(device, stream.has_value()),
      chunks(*policy, rollout.observations, &timer, &graphs) {
  if (config.train.weight_average > 0) average.emplace(*policy, config.train.weight_average);
  if (teacher) {
    teacher->enter(*simulator);
    rollout.teacher_log_probs =
        at::zeros({rollout.num_steps(), rollout.num_slots(), kNumActions}, rollout.log_probs.options());
  }
  if (teacher && config.train.teacher_scene_coef > 0) {
    const int64_t width = teacher->scene_width(), expected = policy->scene_width();
    PICTURA_CHECK(width == expected,
                  "{}: train.teacher_scene_coef: the teacher's scene embeddings have {} numbers (see "
                  "policy.embedding_width), expected {}, as in the learner",
                  config.train.teacher, width, expected);
    rollout.teacher_scene = at::zeros({rollout.num_steps(), rollout.num_slots(), width}, rollout.log_probs.options());
  }
  if (opponents) opponents->enter(*simulator);
  if (config.policy.decision_steps > 1) rollout.decides = at::ones_like(rollout.valid);
  for (const auto& change : config.render.schedule) policy->check_images(rig_of(config, change.agent_steps));
}

void Run::on_stream(const std::function<void()>& work) const { stream ? stream->run(work) : work(); }

SavedPolicy Run::saved_policy() const {
  SavedPolicy saved;
  saved.config = in_force;
  saved.rig = rig;
  saved.backbone_hash = policy->backbone_hash();
  saved.update = update;
  saved.agent_steps = agent_steps;
  saved.parameters = policy->parameters();
  for (size_t i = 0; i < saved.parameters.size(); ++i) {
    if (optimizer.rate_factors[i] != 1) saved.rate_factors[saved.parameters[i].name] = optimizer.rate_factors[i];
  }
  return saved;
}

SavedPolicy Run::averaged_policy() const {
  SavedPolicy saved = saved_policy();
  saved.parameters = average->values;
  return saved;
}

Checkpoint Run::checkpoint(const std::vector<RecentUpdate>& recent) const {
  Checkpoint checkpoint{saved_policy()};
  checkpoint.distance_m = distance_m;
  checkpoint.adam_steps = optimizer.steps;
  checkpoint.filter_average = filter.average;
  checkpoint.recent = recent;
  checkpoint.longest_update_s = longest_update_s;
  checkpoint.first_moments = optimizer.first_moments;
  checkpoint.second_moments = optimizer.second_moments;
  if (average) {
    checkpoint.average = average->values;
    checkpoint.averaged_updates = average->updates;
  }
  checkpoint.simulator = simulator->save();
  if (communicator->size() > 1 && scenes) {
    checkpoint.simulator.clear();  // no rank has the scenes of all ranks
  } else if (communicator->size() > 1) {
    const std::vector<std::vector<uint8_t>> parts = communicator->gather(checkpoint.simulator);
    checkpoint.simulator.clear();
    if (communicator->is_first()) checkpoint.simulator = join_saved_states(*simulator, all_worlds, parts);
  }
  return checkpoint;
}

UpdateStats Run::update_policy() {
  const UpdateKey key{config.run.seed, update, learning_rate_at(config.train, agent_steps),
                      teacher_weight_at(config.train, agent_steps)};
  UpdateStats stats;
  on_stream([&] {
    stats =
        ppo_update({&chunks, executor.get(), &optimizer, &filter, &timer, communicator}, &rollout, config.train, key);
    stats.weights = weight_rms(policy->parameters());
  });
  return stats;
}

std::string Run::update_image_size() {
  if (config.render.schedule.empty()) return "";
  const Config before = in_force;
  in_force = config_at(config, agent_steps);
  const auto size_of = [](const Config& c) { return fmt::format("{}x{}", c.render.width_px, c.render.height_px); };
  const auto patches_of = [](const Config& c) {
    return fmt::format(" in patches of {} px, lines of {} px or more,", c.policy.patch_px, c.render.line_floor_px);
  };
  const bool has_other_patches = patches_of(before) != patches_of(in_force);
  if (size_of(before) == size_of(in_force) && !has_other_patches) return "";
  rig = rig_of(config, agent_steps);
  renderer.reset();  // frees its memory before the next renderer allocates memory
  renderer = make_training_renderer(in_force, rig, *simulator);
  rollout.observations.set_renderer(renderer.get());
  chunks.clear();
  if (in_force.policy.patch_px != before.policy.patch_px) {
    on_stream([&] {
      spread_first_convolution(*policy, in_force.policy.patch_px / before.policy.patch_px, &optimizer,
                               average ? &*average : nullptr);
    });
  }
  return fmt::format("from {} agent-steps on images are {}{} instead of {}{}", agent_steps, size_of(in_force),
                     has_other_patches ? patches_of(in_force) : "", size_of(before),
                     has_other_patches ? fmt::format(" in patches of {} px", before.policy.patch_px) : "");
}

void Run::restore_rate_factors(const SavedPolicy& saved) {
  std::map<std::string, double> left = saved.rate_factors;
  for (size_t i = 0; i < optimizer.rate_factors.size(); ++i) {
    const auto its = left.extract(policy->parameters()[i].name);
    optimizer.rate_factors[i] = its.empty() ? 1 : its.mapped();
    PICTURA_CHECK(optimizer.rate_factors[i] > 0 && optimizer.rate_factors[i] <= 1,
                  "{}: rate_factors: {}: expected a number in (0, 1], got {}", saved.path, policy->parameters()[i].name,
                  optimizer.rate_factors[i]);
  }
  PICTURA_CHECK(left.empty(), "{}: rate_factors: the policy has no parameter '{}'", saved.path, left.begin()->first);
}

bool Run::exchange_scenes() {
  if (!scenes || scenes->set_after(update) == scene_set) return false;
  enter_scenes(scenes->set_after(update));
  return true;
}

void Run::enter_scenes(int64_t set) {
  if (set == scene_set) return;
  SceneSet next = scenes->take(set);
  on_stream([&] {
    simulator->set_worlds(std::move(next.maps), {}, std::move(next.worlds), next.seed, current_stream(device));
  });
  scene_set = set;
  if (renderer) upload_maps(*simulator, renderer.get());
  if (teacher) teacher->enter(*simulator);
  if (opponents) opponents->enter(*simulator);
}

ImageSize Run::image_size() const {
  return renderer ? ImageSize{rig.cameras[0].width_px, rig.cameras[0].height_px} : ImageSize{};
}

void Run::load_policy(const SavedPolicy& other) {
  PICTURA_CHECK(
      !config.reads_images() || !other.config.reads_images() || other.rig.cameras.size() == rig.cameras.size(),
      "{}: its policy uses {} cameras, expected {}, as in {}", other.path, other.rig.cameras.size(), rig.cameras.size(),
      config.render.rig.empty() ? "the paper's rig" : config.render.rig);
  check_network_settings(other, config,
                         {{"policy.segment_features", &PolicySection::segment_features},
                          {"policy.layer_norm", &PolicySection::layer_norm},
                          {"policy.conv_norm", &PolicySection::conv_norm},
                          {"policy.residual", &PolicySection::residual}});
  restore_policy(other, *policy);
  restore_rate_factors(other);
  if (average) average->restart();
}

void Run::load_trunk(const SavedPolicy& other) {
  check_network_settings(
      other, config,
      {{"policy.layer_norm", &PolicySection::layer_norm}, {"policy.residual", &PolicySection::residual}});
  const at::NoGradGuard no_grad;
  // The last ego features are auxiliary, and 0 for a policy that was trained without them.
  const int64_t ego_features = num_ego_features(config.reads_images() || other.config.reads_images());
  std::vector<NamedTensor> from = other.parameters, to = policy->trunk_parameters();
  for (std::vector<NamedTensor>* tensors : {&from, &to}) {
    for (NamedTensor& tensor : *tensors) {
      if (tensor.name == "ego.hidden.weight") tensor.value = tensor.value.narrow(1, 0, ego_features);
    }
  }
  copy_tensors(other.path, from, to);
  if (average) average->restart();
}

std::string Run::restore(const Checkpoint& saved) {
  const std::string difference = first_difference(saved.config, config_at(config, saved.agent_steps));
  PICTURA_CHECK(difference.empty(), "{}: saved with a different configuration: {}", saved.path, difference);
  agent_steps = saved.agent_steps;
  update_image_size();
  const std::string rig_difference = config.reads_images() ? first_difference(saved.rig, rig) : "";
  PICTURA_CHECK(rig_difference.empty(), "{}: saved with cameras that differ from those of {}: {}", saved.path,
                config.render.rig.empty() ? "the paper's rig" : config.render.rig, rig_difference);
  restore_policy(saved, *policy);
  restore_rate_factors(saved);
  if (saved.config.train.optimizer == config.train.optimizer) {
    restore_tensors(saved.path, saved.first_moments, optimizer.first_moments);
    restore_tensors(saved.path, saved.second_moments, optimizer.second_moments);
    optimizer.steps = saved.adam_steps;
  }
  if (average && saved.average.empty()) {
    average->restart();
  } else if (average) {
    restore_tensors(saved.path, saved.average, average->values);
    average->updates = saved.averaged_updates;
  }
  filter.average = saved.filter_average;
  update = saved.update;
  distance_m = saved.distance_m;
  longest_update_s = saved.longest_update_s;
  if (scenes) enter_scenes(scenes->set_after(std::max<int64_t>(update - 1, 0)));
  std::string why_new_episodes;
  try {
    PICTURA_CHECK(communicator->size() == 1 || !scenes, "recorded scenes on several ranks");
    if (communicator->size() == 1) {
      simulator->restore(saved.simulator);
    } else {
      simulator->restore(
          extract_saved_part(*simulator, all_worlds, saved.simulator, communicator->rank(), communicator->size()));
    }
  } catch (const Error& error) {
    why_new_episodes = error.what();
  }
  if (communicator->max_of(why_new_episodes.empty() ? 0 : 1) > 0) {
    simulator->reset();
    if (why_new_episodes.empty()) why_new_episodes = "another rank cannot read its part";
  }
  return why_new_episodes;
}

void Run::check_ranks_agree() const {
  if (communicator->size() == 1) return;
  // Compares a sum of each parameter's bits: if all ranks are equal, its minimum and maximum over ranks agree.
  std::vector<at::Tensor> sums;
  for (const NamedTensor& parameter : policy->parameters()) {
    sums.push_back(parameter.value.detach().view(at::kInt).sum(at::kLong));
  }
  const at::Tensor own = at::stack(sums), extremes = at::stack({own, -own});
  communicator->max(extremes);
  const at::Tensor differs = at::nonzero(extremes[0] + extremes[1]).cpu();
  PICTURA_CHECK(differs.size(0) == 0, "update {}: the ranks' policies differ: parameter '{}'", update,
                policy->parameters()[differs[0].item<int64_t>()].name);
}

}  // namespace pictura
