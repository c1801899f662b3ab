// Descriptions of a configuration's keys for documents. In addition: sentences on settings without effect, and a
// configuration with absolute paths.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Documentation of a key of the configuration.
struct ConfigKey {
  std::string key, default_value, values;  // such as "train.gamma", "0.999" and "0 to 1"
};

/// Returns every key, in the order of to_toml().
std::vector<ConfigKey> config_keys();

/// Returns a sentence for each setting that has no effect but is not an error.
std::vector<std::string> settings_without_effect(const Config& config);

/// Returns the configuration with absolute paths of its files (rig, maps, other policies, teacher, backbone), so that
/// it can be read in any folder.
Config with_absolute_paths(Config config);

}  // namespace pictura
