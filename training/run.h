// Training run with all its objects. Each rank has its own worlds and a copy of everything else.
#pragma once

#include <optional>

#include "pictura/configuration/apply_config.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/opponents.h"
#include "pictura/training/ppo.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/scene_sets.h"
#include "pictura/training/teacher.h"
#include "pictura/training/weight_average.h"

namespace pictura {

struct Run {
  /// Creates a run that learns, simulates and draws on `device`. A null `policy` creates a new policy. Throws Error
  /// naming file and key for maps, cameras and sizes that cannot be used for training.
  Run(const Config& config, Device device, Communicator* communicator = single_communicator(),
      std::unique_ptr<const Policy> policy = nullptr);

  /// Calls `work`; with graphs, on a torch stream that can be captured.
  void on_stream(const std::function<void()>& work) const;

  /// Copies another run's weights. Throws Error naming the difference if the networks differ.
  void load_policy(const SavedPolicy& other);
  /// Copies the weights behind the scene encoder from a policy of any modality. If one of both reads images, auxiliary
  /// ego features are not copied. Throws Error naming file and the first parameter whose shape differs.
  void load_trunk(const SavedPolicy& other);
  SavedPolicy saved_policy() const;
  /// Policy with averaged weights, if the run averages them.
  SavedPolicy averaged_policy() const;
  /// Returns a checkpoint at the start of an update. Only rank 0's checkpoint may be written, because others contain no
  /// simulator state. Collective: every rank must call it.
  Checkpoint checkpoint(const std::vector<RecentUpdate>& recent) const;
  /// Resumes from a checkpoint of any number of ranks. If the simulator cannot read its state, new episodes begin, and
  /// the result is the reason; else it is empty. Ignores moments of another optimizer. Throws Error naming the
  /// difference if configuration or cameras differ.
  std::string restore(const Checkpoint& saved);
  /// Improves the policy on the rollout. Throws as ppo_update() does.
  UpdateStats update_policy();
  /// Throws Error naming a parameter that is not bit-identical on all ranks.
  void check_ranks_agree() const;

  /// Switches to the image size of render.schedule for the completed agent-steps, and spreads the first convolution's
  /// weights over larger patches. Returns a sentence about the change, or an empty text.
  std::string update_image_size();
  /// Replaces recorded scenes if others are due, and returns whether it did. All worlds then begin new episodes, and
  /// graphs of the earlier worlds are invalid.
  bool exchange_scenes();
  /// Size of the first camera's images; 0 without images.
  ImageSize image_size() const;

  const Config config;
  Config in_force;  // config_at(config, agent_steps) at the last update_image_size()
  const Device device;
  Communicator* const communicator;
  const std::vector<WorldSpec> all_worlds;  // worlds of all ranks
  Rig rig;
  const std::unique_ptr<Teacher> teacher;      // null without train.teacher
  const std::unique_ptr<Opponents> opponents;  // null without simulator.others.policies
  const SimulatorConfig world;
  const std::unique_ptr<SceneSets> scenes;  // null without recorded scenes
  const std::unique_ptr<Simulator> simulator;
  std::unique_ptr<Renderer> renderer;  // null for policies without images
  const std::unique_ptr<LearnerExecutor> executor;
  PhaseTimer timer;
  const std::unique_ptr<const Policy> policy;
  Optimizer optimizer;
  std::optional<WeightAverage> average;  // only with train.weight_average
  AdvantageFilter filter;
  Rollout rollout;
  const std::optional<OwnStream> stream;  // only with graphs
  Graphs graphs;
  ChunkRunner chunks;
  int64_t scene_set = 0;    // set of scenes in the worlds
  int64_t update = 0;       // completed updates
  int64_t agent_steps = 0;  // steps of active agents in completed updates
  double distance_m = 0;    // total of all agents in completed updates
  // Longest wall times in s. Keys are like "NVIDIA H100 80GB HBM3, 20480 agents"; for evaluations they end in ",
  // evaluation". An entry for updates holds the longest of the last process that completed an update with this key.
  std::map<std::string, double> longest_update_s;

 private:
  void enter_scenes(int64_t set);
  /// Parameters without a saved factor get 1.
  void restore_rate_factors(const SavedPolicy& saved);
};

}  // namespace pictura
