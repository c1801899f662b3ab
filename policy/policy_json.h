// JSON headers of checkpoints and safetensors.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns names and shapes of the policy's input and output arrays.
nlohmann::ordered_json schema_to_json(const Config& config);
/// Throws Error naming the file and the first entry in which the saved schema differs from that of `config`.
void check_schema(const nlohmann::ordered_json& saved, const Config& config, const std::string& path);

nlohmann::ordered_json rig_to_json(const Rig& rig);
/// Throws nlohmann::json::exception or Error if the JSON does not describe cameras.
Rig rig_from_json(const nlohmann::ordered_json& cameras);

}  // namespace pictura
