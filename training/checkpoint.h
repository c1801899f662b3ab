// Checkpoint: file (policy/checkpoint_file.h) from which training continues exactly.
#pragma once

#include <map>
#include <string>

#include "pictura/policy/saved_policy.h"

namespace pictura {

/// Contribution of an update to the mean return.
struct RecentUpdate {
  int64_t finished = 0;  // ended agent episodes
  double finished_return = 0;
};

struct Checkpoint : SavedPolicy {
  double distance_m = 0;  // total of all agents
  int64_t adam_steps = 0;
  double filter_average = -1;  // AdvantageFilter::average
  std::vector<RecentUpdate> recent;
  std::map<std::string, double> longest_update_s;          // see Run::longest_update_s
  std::vector<NamedTensor> first_moments, second_moments;  // see Optimizer
  std::vector<NamedTensor> average;                        // WeightAverage::values; empty: no average
  int64_t averaged_updates = 0;
  std::vector<uint8_t> simulator;  // Simulator::save() at the start of update `update`
};

/// Writes through a temporary file. Throws Error naming the path.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

/// Throws Error naming the file if it is not a checkpoint, is truncated or damaged, or has another version or byte
/// order. Also throws if the observation schema differs, naming the first different entry.
Checkpoint read_checkpoint(const std::string& path);
/// Parses a file's bytes. Throws as read_checkpoint() does.
Checkpoint parse_checkpoint(const std::string& bytes, const std::string& path);

/// Describes the first difference of two rigs; empty if they are equal.
std::string first_difference(const Rig& saved, const Rig& now);

}  // namespace pictura
