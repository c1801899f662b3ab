// Folder of a training run: the files that belong to a run, and the checkpoints that are kept.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pictura {

/// Returns the names of a run's files in a folder, in alphabetical order, without its lock
/// (common/support/folder_lock.h). A training run writes and removes only files with these names. Throws Error for a
/// file that is a link, because a link in a folder from elsewhere could make a run write into any file.
std::vector<std::string> run_files(const std::string& folder);

/// Calls save(path) to write the next checkpoint.ckpt, and keeps num_kept - 1 previous checkpoints as checkpoint.1.ckpt
/// (the newest), checkpoint.2.ckpt and so on. The file checkpoint.ckpt is complete at any time, and keeps its
/// permissions.
void save_checkpoint(const std::string& folder, int64_t num_kept,
                     const std::function<void(const std::string& path)>& save);

/// Returns the name of a milestone, such as milestone_250M.ckpt. The name contains the last multiple of `distance` that
/// an update from `before` to `after` agent-steps has passed. Empty if there is no such multiple, or if `distance` is
/// 0.
std::string milestone_name(int64_t before, int64_t after, int64_t distance);

}  // namespace pictura
