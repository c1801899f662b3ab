// Training run: all that it consists of, made from a configuration, saved to a checkpoint and restored from one. Of
// several ranks each has its part of the worlds, and all of the rest.
#pragma once

#include <optional>

#include "pictura/configuration/apply_config.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/opponents.h"
#include "pictura/training/ppo.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/teacher.h"
#include "pictura/training/weight_average.h"

namespace pictura {

struct Run {
  /// Run that learns on `device`, where simulator and renderer work too, the configuration's policy, or `policy` where
  /// there is one. Throws Error naming file and key for maps, cameras and sizes that cannot be trained with.
  Run(const Config& config, Device device, Communicator* communicator = alone(),
      std::unique_ptr<const Policy> policy = nullptr);

  /// Calls `work`: where graphs are used, on a stream that they can be captured from.
  void on_stream(const std::function<void()>& work) const;

  /// Takes the weights of another run. Throws Error naming what differs where they are another network's.
  void begin_with(const SavedPolicy& other);
  /// Returns the policy as it is now.
  SavedPolicy saved_policy() const;
  /// Returns the policy with the average of weights; only for runs that have one.
  SavedPolicy averaged_policy() const;
  /// Returns what a checkpoint holds, at the start of an update: of all ranks, for rank 0 to write; that of other ranks
  /// has no simulator.
  Checkpoint checkpoint(const std::vector<RecentUpdate>& recent) const;
  /// Goes on from a checkpoint of any number of ranks. Where the simulator cannot read its saved state, because its
  /// rules or maps have changed since, new episodes begin; the return value says why, else it is empty. Moments of
  /// another optimizer are left, and new ones start. Throws Error naming what differs when the checkpoint was saved
  /// under another configuration or with other cameras.
  std::string restore(const Checkpoint& saved);
  /// Improves the policy on the rollout. Throws what ppo_update() throws.
  UpdateStats improve();
  /// Throws Error naming a parameter in which the ranks' policies differ by a bit.
  void check_ranks_agree() const;

  /// Draws images of the size that render.schedule has for the agent-steps done, and spreads the first convolution
  /// where their patches grow. Returns a sentence that says what changes, or an empty text.
  std::string update_image_size();
  /// Size of the first camera's images as they are drawn now; 0 without images.
  ImageSize image_size() const;

  const Config config;
  Config in_force;  // config_at(config, agent_steps), as of the last update_image_size()
  const Device device;
  Communicator* const communicator;
  const std::vector<WorldSpec> all_worlds;       // of all ranks
  Rig rig;                                       // as it is now
  const std::unique_ptr<const Teacher> teacher;  // null without train.teacher
  const std::unique_ptr<Opponents> opponents;    // null without simulator.others.policies
  const std::unique_ptr<Simulator> simulator;
  std::unique_ptr<Renderer> renderer;  // of policies with images
  const std::unique_ptr<LearnerExecutor> executor;
  PhaseTimer timer;
  const std::unique_ptr<const Policy> policy;
  Optimizer optimizer;
  std::optional<WeightAverage> average;  // of runs with train.weight_average
  AdvantageFilter filter;
  Rollout rollout;
  const std::optional<OwnStream> stream;  // where graphs are used
  Graphs graphs;                          // of `chunks`
  ChunkRunner chunks;
  int64_t update = 0;       // updates done
  int64_t agent_steps = 0;  // in these
  double distance_m = 0;    // driven by all agents in these
  // Wall time by device and agents, as "NVIDIA H100 80GB HBM3, 20480 agents": of the longest update of the last process
  // that made one there; and with ", evaluation" after it, of the longest evaluation within the run.
  std::map<std::string, double> longest_update_s;

 private:
  /// Gives the parameters the rate factors of a saved policy, and the others 1.
  void restore_rate_factors(const SavedPolicy& saved);
};

}  // namespace pictura
