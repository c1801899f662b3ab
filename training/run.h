// Training run: all its objects, created from a configuration, saved to a checkpoint and restored from one. With
// several ranks each rank has its part of the worlds, and all of the rest.
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

  /// Calls `work`, with graphs on a stream that can be captured.
  void on_stream(const std::function<void()>& work) const;

  /// Copies the weights of another run. Throws Error naming the difference if the networks differ.
  void load_policy(const SavedPolicy& other);
  /// Returns the current policy.
  SavedPolicy saved_policy() const;
  /// Returns the policy with averaged weights; only for runs that average them.
  SavedPolicy averaged_policy() const;
  /// Returns the contents of a checkpoint at the start of an update. Collective over all ranks; rank 0 writes it, and
  /// the results of other ranks contain no simulator.
  Checkpoint checkpoint(const std::vector<RecentUpdate>& recent) const;
  /// Resumes from a checkpoint of any number of ranks. If the simulator cannot read its saved state, because its rules
  /// or maps have changed since, new episodes begin, and the return value states the reason; else it is empty. Moments
  /// of another optimizer are discarded, and new moments start. Throws Error naming the difference if the checkpoint
  /// was saved under another configuration or with other cameras.
  std::string restore(const Checkpoint& saved);
  /// Improves the policy on the rollout. Throws the errors of ppo_update().
  UpdateStats update_policy();
  /// Throws Error naming a parameter that differs in a bit between ranks.
  void check_ranks_agree() const;

  /// Switches to the image size that render.schedule has for the completed agent-steps, and spreads the first
  /// convolution if its patches grow. Returns a sentence that describes the change, or an empty text.
  std::string update_image_size();
  /// Replaces recorded scenes by those that are due after the completed updates; returns whether it did. All worlds
  /// then begin new episodes, and graphs of the previous worlds are stale.
  bool exchange_scenes();
  /// Current size of the first camera's images; 0 without images.
  ImageSize image_size() const;

  const Config config;
  Config in_force;  // config_at(config, agent_steps) of the last update_image_size()
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
  int64_t scene_set = 0;    // set of recorded scenes in the worlds
  int64_t update = 0;       // completed updates
  int64_t agent_steps = 0;  // agent-steps of the completed updates
  double distance_m = 0;    // distance driven by all agents in the completed updates
  // Longest wall times by device and number of agents, such as "NVIDIA H100 80GB HBM3, 20480 agents": of the updates of
  // the last process that completed an update on that device; and, with the suffix ", evaluation", of the evaluations
  // within the run.
  std::map<std::string, double> longest_update_s;

 private:
  /// Replaces the worlds' scenes by those of a set.
  void enter_scenes(int64_t set);
  /// Sets the rate factors of parameters from a saved policy, and all others to 1.
  void restore_rate_factors(const SavedPolicy& saved);
};

}  // namespace pictura
