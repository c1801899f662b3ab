// Options that name what computes: simulators, renderers, devices.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/driving/world.h"

namespace pictura {

/// Takes these names alone; the complaint lists them.
CLI::Validator one_of(const std::vector<std::string>& names);

/// Adds --simulator, --renderer (or --backend) and --samples, whose help names `otherwise` as what counts without them.
/// Options are BackendOptions, or SessionOptions, which are left as they are by what is not given.
template <typename Options>
void add_backend_options(CLI::App* command, const std::string& otherwise, Options* options_out);

/// Adds --device as well: what a policy runs on.
template <typename Options>
void add_policy_backend_options(CLI::App* command, const std::string& otherwise, Options* options_out);

/// The options that were given as overrides of a training configuration.
std::vector<std::string> overrides_of(const BackendOptions& options);

}  // namespace pictura
