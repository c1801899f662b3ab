// What there is to say about a configuration's keys besides their values: for documents, notices and readers in other
// folders.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pictura/training/config.h"

namespace pictura {

/// A key of the configuration, as documents say it.
struct ConfigKey {
  std::string key, default_value, values;  // "train.gamma", "0.999", "0 to 1"
};

/// Every key, in the order of the file that to_toml() writes.
std::vector<ConfigKey> config_keys();

/// The keys that decide what an evaluation counts and that no option of it replaces, with their values as to_toml()
/// writes them: of the worlds, and of the policy where there is one.
std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy);

/// What of a configuration has no effect though it is no contradiction, a sentence each.
std::vector<std::string> idle_settings(const Config& config);

/// The configuration with absolute paths of its files (rig, maps, teacher, backbone), for readers in any folder.
Config with_absolute_paths(Config config);

}  // namespace pictura
