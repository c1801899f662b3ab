// Scripts by which shells complete the command's words, made from the tree of its subcommands and options.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// For "bash", "zsh" or "fish". Throws UsageError for another shell.
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace pictura
