// Configuration keys for documents and messages.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Documentation of a key.
struct ConfigKey {
  std::string key, default_value, values;  // such as "train.gamma", "0.999" and "0 to 1"
};

/// Returns every key, in the order of to_toml().
std::vector<ConfigKey> config_keys();

/// Returns a sentence for each valid setting that has no effect.
std::vector<std::string> settings_without_effect(const Config& config);

/// Returns the configuration with absolute paths.
Config with_absolute_paths(Config config);

}  // namespace pictura
