// The folder of a training run: which of the files there are a run's own, and which checkpoints are kept.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pictura {

/// Names of the files of a run that lie in a folder, in order; its lock (common/support/folder_lock.h), which says
/// nothing of a run, is not among them. Files of these names are all that a training run writes, or removes. Throws
/// Error for one that is a link: a folder that came from elsewhere would have a run write into files anywhere.
std::vector<std::string> run_files(const std::string& folder);

/// Calls save(path) for what becomes checkpoint.ckpt, and keeps num_kept - 1 before it as checkpoint.1.ckpt, which is
/// the newest of them, checkpoint.2.ckpt, ... Wherever it ends, checkpoint.ckpt is whole; it keeps its mode.
void save_checkpoint(const std::string& folder, int64_t num_kept,
                     const std::function<void(const std::string& path)>& save);

/// The file of the last multiple of `distance` agent-steps that an update passed which began at `before` and ended at
/// `after`, as milestone_250M.ckpt; empty if there was none, or where the distance is 0.
std::string milestone_name(int64_t before, int64_t after, int64_t distance);

}  // namespace pictura
