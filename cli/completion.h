// Scripts for shell completion.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Throws UsageError for shells other than "bash", "zsh" and "fish".
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace pictura
