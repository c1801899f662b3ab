// Everything that a training run consists of: made from a configuration, saved to a checkpoint and restored from one.
#pragma once

#include "pictura/training/checkpoint.h"
#include "pictura/training/ppo.h"

namespace pictura {

struct Run {
  /// Throws Error naming file and key for maps, cameras and sizes that cannot be trained with.
  explicit Run(const Config& config);

  /// Writes a checkpoint under another name and renames it to path. `simulator_bytes` is Simulator::save() at the start
  /// of an update.
  void save(const std::string& path, const std::vector<RecentUpdate>& recent,
            std::vector<uint8_t> simulator_bytes) const;
  /// Goes on from a checkpoint. Throws Error naming what differs when it was saved under another configuration or with
  /// other cameras.
  void restore(const Checkpoint& saved);

  const Config config;
  const Rig rig;
  const std::unique_ptr<Simulator> simulator;
  const std::unique_ptr<Renderer> renderer;  // of policies with images
  Observer observer;
  const Policy policy;
  AdamW optimizer;
  AdvantageFilter filter;
  Rollout rollout;
  int64_t update = 0;       // updates done
  int64_t agent_steps = 0;  // in these
  double distance_m = 0;    // driven by all agents in these
};

}  // namespace pictura
