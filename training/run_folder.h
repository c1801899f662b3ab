// The folder of a training run: which of the files there are a run's own.
#pragma once

#include <string>
#include <vector>

namespace pictura {

/// Names of the files of a run that lie in a folder, in order; its lock (common/support/folder_lock.h), which says
/// nothing of a run, is not among them. Files of these names are all that a training run writes, or removes.
std::vector<std::string> run_files(const std::string& folder);

}  // namespace pictura
