// Paths and names of golden scenes. PICTURA_GOLDEN_DIR is this folder.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace pictura {

inline std::string scene_path(const std::string& name) { return PICTURA_GOLDEN_DIR "/" + name + ".toml"; }
inline std::string picture_path(const std::string& name) { return PICTURA_GOLDEN_DIR "/" + name + ".png"; }

/// Returns sorted names of files with this extension.
inline std::vector<std::string> golden_names(const std::string& extension) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(PICTURA_GOLDEN_DIR)) {
    if (entry.path().extension() == extension) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace pictura
