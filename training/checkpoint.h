// Checkpoint: one file (policy/checkpoint_file.h) from which training continues exactly and a policy can be loaded.
#pragma once

#include <map>
#include <string>

#include "pictura/policy/saved_policy.h"

namespace pictura {

/// Contribution of one update to the mean return of recent updates.
struct RecentUpdate {
  int64_t finished = 0;  // agent episodes that ended
  double finished_return = 0;
};

struct Checkpoint : SavedPolicy {
  double distance_m = 0;  // distance driven by all agents
  int64_t adam_steps = 0;
  double filter_average = -1;  // AdvantageFilter::average
  std::vector<RecentUpdate> recent;
  std::map<std::string, double> longest_update_s;          // see Run::longest_update_s
  std::vector<NamedTensor> first_moments, second_moments;  // see Optimizer
  std::vector<NamedTensor> average;                        // WeightAverage::values; empty for runs without one
  int64_t averaged_updates = 0;                            // number of updates in the average
  std::vector<uint8_t> simulator;  // result of Simulator::save() at the start of update `update`
};

/// Writes a temporary file and renames it to `path`. Throws Error naming the path.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

/// Reads a checkpoint. Throws Error naming the file if it is not a checkpoint, is truncated or damaged, or has another
/// version or byte order. If the observation schema differs, the error also names the entry that differs.
Checkpoint read_checkpoint(const std::string& path);
/// Parses the bytes of a checkpoint file. Throws as read_checkpoint() does.
Checkpoint parse_checkpoint(const std::string& bytes, const std::string& path);

/// Returns a text with the first camera and property in which two rigs differ, and both values. Empty if the rigs are
/// equal.
std::string first_difference(const Rig& saved, const Rig& now);

}  // namespace pictura
