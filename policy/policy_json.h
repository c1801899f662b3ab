// What headers of checkpoints and of safetensors say of a policy, in JSON. Only for the files that read and write them.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/configuration/config.h"

namespace pictura {

/// What the numbers that a policy reads and gives mean: the shapes of its arrays. It cannot drive where these differ.
nlohmann::ordered_json schema_to_json(const Config& config);
/// Throws Error naming the file and the entry in which the saved schema is not that of a policy of `config` today.
void check_schema(const nlohmann::ordered_json& saved, const Config& config, const std::string& path);

nlohmann::ordered_json rig_to_json(const Rig& rig);
/// Throws nlohmann::json::exception or Error where these are no cameras.
Rig rig_from_json(const nlohmann::ordered_json& cameras);

}  // namespace pictura
