// Folder of a training run, which is its own while it runs, and holds its checkpoints and weights.
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

/// Keeper of a run's folder. Rank 0 alone reads and writes; its functions are collective, since a checkpoint has
/// something of each rank.
class RunKeeper {
 public:
  /// Takes the folder for this process. Throws Error naming it where another run is at work in it, where one lies that
  /// options.old_run does not speak of, and where a file of a run is a link. What is given must outlive this.
  RunKeeper(const TrainOptions& options, Ranks* ranks, Communicator* communicator);

  /// Begins the run as the options say: from its last checkpoint, from the weights of another run, or anew, when the
  /// untrained policy is kept too. A run that is overwritten stays until the first save(). Returns what the mean return
  /// of its last updates is made of.
  std::vector<RecentUpdate> begin(Run* run);

  /// Whether the configuration asks for a checkpoint after the update that the run has just made.
  bool is_due(const Run& run) const;
  /// Saves the run as checkpoint.ckpt and keeps older ones, unless it is saved already.
  void save(const Run& run, const std::vector<RecentUpdate>& recent);
  /// Saves the run under another name in the folder, which later saves leave alone.
  void save_as(const std::string& name, const Run& run, const std::vector<RecentUpdate>& recent) const;
  /// Writes the weights as policy.safetensors, and their average, where there is one, as policy_average.safetensors.
  void write_weights(const Run& run) const;

  /// Where the run's files are: options.out_folder, or, until the first checkpoint of a run that overwrites another, a
  /// folder in it.
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
  std::vector<std::string> old_files_;  // of an earlier run
  std::string folder_;
  int64_t saved_update_ = -1;
  Stopwatch since_saved_;
};

}  // namespace pictura
