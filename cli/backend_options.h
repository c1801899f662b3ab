// Options that name what computes: simulators, renderers, devices.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/policy/session_options.h"

namespace pictura {

/// Takes these names alone; the complaint lists them.
CLI::Validator one_of(const std::vector<std::string>& names);

/// Adds --simulator, --renderer (or --backend) and --samples, whose help names `otherwise` as what counts without them.
void add_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out);

/// Adds --device as well: what a policy runs on.
void add_policy_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out);

/// What of these is not empty as overrides of a training configuration.
std::vector<std::string> overrides_of(const SessionOptions& options);

}  // namespace pictura
