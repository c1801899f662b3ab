// Error messages for invalid command lines.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns a line that describes the error of parse(). An unknown word takes precedence over other errors. The line
/// then contains the nearest known word, or the reason why this build lacks the word.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace pictura
