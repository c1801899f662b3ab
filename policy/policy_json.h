// Description of a policy in the headers of checkpoints and safetensors, in JSON. Only code that reads and writes these
// formats should include this header.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the observation schema: names and shapes of the policy's input and output arrays. A policy whose schema
/// differs from the current schema cannot be used.
nlohmann::ordered_json schema_to_json(const Config& config);
/// Throws Error if the saved schema differs from the current schema of `config`; the message names the file and the
/// first different entry.
void check_schema(const nlohmann::ordered_json& saved, const Config& config, const std::string& path);

nlohmann::ordered_json rig_to_json(const Rig& rig);
/// Throws nlohmann::json::exception or Error if the JSON does not describe cameras.
Rig rig_from_json(const nlohmann::ordered_json& cameras);

}  // namespace pictura
