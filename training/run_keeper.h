// Folder of a training run, with its checkpoints and weights. The run owns the folder while it is active.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/support/folder_lock.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/training/loop.h"
#include "pictura/training/ranks/ranks.h"
#include "pictura/training/run.h"

namespace pictura {

/// Keeper of a run's folder. Only rank 0 reads and writes. Every rank must call each function, because a checkpoint
/// contains data of each rank.
class RunKeeper {
 public:
  /// Claims the folder for this process. Throws Error naming the folder if another run is active in it, or if it holds
  /// a run and options.old_run is `refuse`. Throws Error naming a run's file that is a link. The arguments must outlive
  /// the object.
  RunKeeper(const TrainOptions& options, Ranks* ranks, Communicator* communicator);

  /// Starts the run as the options specify: from its last checkpoint, from the weights of another run, or from new
  /// weights. In the last case it also saves the untrained policy. A run that is overwritten stays until the first
  /// save(). Returns the recent updates, over which the log averages returns.
  std::vector<RecentUpdate> begin(Run* run);

  /// Whether the configuration asks for a checkpoint after the run's latest update.
  bool is_due(const Run& run) const;
  /// Saves the run as checkpoint.ckpt and keeps older checkpoints. Does nothing if this update is already saved.
  void save(const Run& run, const std::vector<RecentUpdate>& recent);
  /// Saves the run under another name in the folder. Later saves do not touch this file.
  void save_as(const std::string& name, const Run& run, const std::vector<RecentUpdate>& recent) const;
  /// Writes the weights as policy.safetensors, and their average, if there is one, as policy_average.safetensors.
  void write_weights(const Run& run) const;

  /// Returns the folder of the run's files, which is options.out_folder. If the run overwrites another run, it is a
  /// folder within options.out_folder until the first checkpoint.
  const std::string& folder() const { return folder_; }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string checkpoint_path() const { return path("checkpoint.ckpt"); }

 private:
  void overwrite_old_run();
  void write_with(const std::function<void(const Checkpoint&)>& write, const Run& run,
                  const std::vector<RecentUpdate>& recent) const;

  const TrainOptions& options_;
  Ranks* const ranks_;
  Communicator* const communicator_;
  std::optional<FolderLock> lock_;
  std::vector<std::string> old_files_;  // files of an earlier run
  std::string folder_;
  int64_t saved_update_ = -1;
  Stopwatch since_saved_;
};

}  // namespace pictura
