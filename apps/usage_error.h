// Error messages for invalid command lines.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns one line about the error of parse(). An unknown word comes before anything missing or wrong, with the
/// nearest known word or the reason why this build lacks it.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace pictura
