// Files in the folder of a training run.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pictura {

/// Returns the sorted names of a run's files; the run writes and removes only these. Throws Error for a link, through
/// which a run could write into any file.
std::vector<std::string> run_files(const std::string& folder);

/// Calls save(path) to write the next checkpoint.ckpt. Keeps num_kept - 1 previous files: checkpoint.1.ckpt (the
/// newest), checkpoint.2.ckpt and so on. checkpoint.ckpt is complete at any time, and keeps its permissions.
void save_checkpoint(const std::string& folder, int64_t num_kept,
                     const std::function<void(const std::string& path)>& save);

/// Returns a milestone's name, such as milestone_250M.ckpt. The number is the last multiple of `distance` in (before,
/// after] agent-steps. Empty without such a multiple, or if `distance` is 0.
std::string milestone_name(int64_t before, int64_t after, int64_t distance);

}  // namespace pictura
