// Folder of an active run.
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

/// Owner of a run's folder, with its checkpoints and weights. Only rank 0 reads and writes. Every rank must call each
/// function, because a checkpoint contains data of each rank.
class RunKeeper {
 public:
  /// Claims the folder. Throws Error about the folder as train() does. Throws Error if a file of the run is a link; the
  /// message names it. The arguments must outlive the object.
  RunKeeper(const TrainOptions& options, Ranks* ranks, Communicator* communicator);

  /// Starts the run from its last checkpoint, another run's weights, or new weights, as the options specify. An
  /// overwritten run stays until the first save(). Returns the recent updates for the log.
  std::vector<RecentUpdate> begin(Run* run);

  /// Whether a checkpoint is due after this update, by train.checkpoint_every or train.checkpoint_minutes.
  bool is_due(const Run& run) const;
  /// Saves checkpoint.ckpt and keeps older ones, unless this update is already saved.
  void save(const Run& run, const std::vector<RecentUpdate>& recent);
  /// Saves under another name, which later saves do not touch.
  void save_as(const std::string& name, const Run& run, const std::vector<RecentUpdate>& recent) const;
  /// Writes policy.safetensors, and policy_average.safetensors if the run averages weights.
  void write_weights(const Run& run) const;

  /// Folder of the files: options.out_folder, or a folder within it until the first save of a run that overwrites
  /// another.
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
