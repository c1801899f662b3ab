// Options of simulators, renderers and devices.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/common/support/named_option.h"
#include "pictura/policy/session_options.h"

namespace pictura {

/// The error lists the names.
CLI::Validator one_of(const std::vector<std::string>& names);
/// Accepts the names of devices (kDevices).
CLI::Validator device_name();
/// Returns a function that replaces the old name of a flag's choice, with a warning.
std::function<std::string(std::string)> renaming(const std::string& flag, const RenamedChoice& renamed);

/// Adds --simulator, --renderer (or --backend) and --samples. Their help gives `otherwise` as the default.
void add_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out);

/// Adds the options of add_backend_options(), and --device.
void add_policy_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out);

/// Returns overrides of a training configuration.
std::vector<std::string> overrides_of(const SessionOptions& options);

}  // namespace pictura
