// Descriptions of a configuration's keys besides their values: for documents, notices and readers in other folders.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Key of the configuration, as documented.
struct ConfigKey {
  std::string key, default_value, values;  // for instance "train.gamma", "0.999", "0 to 1"
};

/// Returns every key, in the order of to_toml().
std::vector<ConfigKey> config_keys();

/// Returns a sentence for each setting of a configuration that has no effect without being a contradiction.
std::vector<std::string> settings_without_effect(const Config& config);

/// Returns the configuration with absolute paths of its files (rig, maps, teacher, backbone), for readers in any
/// folder.
Config with_absolute_paths(Config config);

}  // namespace pictura
