#include "pictura/training/run_folder.h"

#include <algorithm>
#include <filesystem>
#include <regex>

namespace pictura {

std::vector<std::string> run_files(const std::string& folder) {
  // The last are what a killed process leaves of common/support/file.h.
  static const std::regex kNames(
      R"(config\.toml|(untrained|checkpoint)\.ckpt|policy\.safetensors|progress\.csv(\.\d+)?|)"
      R"(events\.out\.tfevents\.\d+\.\d+|learning_curve\.png|\.\w+\.\d+\.tmp\.\w+)");
  std::vector<std::string> names;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
    std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && std::regex_match(name, kNames)) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace pictura
