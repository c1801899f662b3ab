// What there is to say about a configuration's keys besides their values: for documents, notices and readers in other
// folders.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// A key of the configuration, as documents say it.
struct ConfigKey {
  std::string key, default_value, values;  // "train.gamma", "0.999", "0 to 1"
};

/// Every key, in the order of the file that to_toml() writes.
std::vector<ConfigKey> config_keys();

/// What of a configuration has no effect though it is no contradiction, a sentence each.
std::vector<std::string> idle_settings(const Config& config);

/// The configuration with absolute paths of its files (rig, maps, teacher, backbone), for readers in any folder.
Config with_absolute_paths(Config config);

}  // namespace pictura
