// Scripts for shell completion of the command's words, generated from the tree of its subcommands and options.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns the script for "bash", "zsh" or "fish". Throws UsageError for another shell.
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace pictura
