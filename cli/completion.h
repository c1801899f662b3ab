// Generates scripts for shell completion from the tree of the command's subcommands and options.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns the script for "bash", "zsh" or "fish". Throws UsageError for other shells.
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace pictura
