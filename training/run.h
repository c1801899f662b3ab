// Training run with all its objects. A run is created from a configuration, and can be saved to a checkpoint and
// restored from one. With several ranks, each rank has a part of the worlds and a copy of everything else.
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
  /// Creates a run that learns on `device`, where simulator and renderer also work. It trains the configuration's
  /// policy, or `policy` if it is given. Throws Error naming file and key for maps, cameras and sizes that cannot be
  /// used for training.
  Run(const Config& config, Device device, Communicator* communicator = single_communicator(),
      std::unique_ptr<const Policy> policy = nullptr);

  /// Calls `work`. If graphs are used, torch's current stream during the call is one that can be captured.
  void on_stream(const std::function<void()>& work) const;

  /// Copies the weights of another run. Throws Error naming the difference if the networks differ.
  void load_policy(const SavedPolicy& other);
  /// Returns the current policy.
  SavedPolicy saved_policy() const;
  /// Returns the policy with averaged weights; only for runs that average them.
  SavedPolicy averaged_policy() const;
  /// Returns the contents of a checkpoint at the start of an update. Collective over all ranks. Only rank 0's result
  /// may be written to a file, because the results of other ranks contain no simulator state.
  Checkpoint checkpoint(const std::vector<RecentUpdate>& recent) const;
  /// Resumes from a checkpoint of any number of ranks. The simulator cannot read its saved state if its rules or maps
  /// have changed since. New episodes then begin, and the return value states the reason; else it is empty. Moments of
  /// another optimizer are ignored, and new moments start at 0. Throws Error naming the difference if the checkpoint
  /// was saved under another configuration or with other cameras.
  std::string restore(const Checkpoint& saved);
  /// Improves the policy on the rollout. Throws the errors of ppo_update().
  UpdateStats update_policy();
  /// Throws Error naming a parameter that is not bit-identical on all ranks.
  void check_ranks_agree() const;

  /// Switches to the image size that render.schedule specifies for the completed agent-steps. If the patches of the
  /// first convolution grow, spreads its weights over them. Returns a sentence that describes the change, or an empty
  /// text.
  std::string update_image_size();
  /// Replaces recorded scenes if other scenes are due after the completed updates. Returns whether scenes were
  /// replaced. If so, all worlds begin new episodes, and graphs of the previous worlds are invalid.
  bool exchange_scenes();
  /// Current size of the first camera's images; 0 without images.
  ImageSize image_size() const;

  const Config config;
  Config in_force;  // result of config_at(config, agent_steps) in the last update_image_size()
  const Device device;
  Communicator* const communicator;
  const std::vector<WorldSpec> all_worlds;       // worlds of all ranks
  Rig rig;                                       // current rig
  const std::unique_ptr<const Teacher> teacher;  // null without train.teacher
  const std::unique_ptr<Opponents> opponents;    // null without simulator.others.policies
  const SimulatorConfig world;                   // configuration of all worlds
  const std::unique_ptr<SceneSets> scenes;       // null without recorded scenes
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
  Graphs graphs;                          // graphs of `chunks`
  ChunkRunner chunks;
  int64_t scene_set = 0;    // number of the set of recorded scenes in the worlds
  int64_t update = 0;       // completed updates
  int64_t agent_steps = 0;  // agent-steps of the completed updates
  double distance_m = 0;    // distance driven by all agents in the completed updates
  // Longest wall times of updates and evaluations, in s. A key consists of device and number of agents, such as "NVIDIA
  // H100 80GB HBM3, 20480 agents"; keys of evaluations within the run have the suffix ", evaluation". Times of updates
  // are those of the last process that completed an update on that device.
  std::map<std::string, double> longest_update_s;

 private:
  /// Replaces the worlds' scenes by those of a set.
  void enter_scenes(int64_t set);
  /// Sets rate factors to those of a saved policy, and to 1 for parameters without a saved factor.
  void restore_rate_factors(const SavedPolicy& saved);
};

}  // namespace pictura
