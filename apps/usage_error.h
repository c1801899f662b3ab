// Error messages for invalid command lines.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns one line about the error of parse(). An unknown word is reported before other errors, with the nearest known
/// word, or with what this build lacks.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace pictura
