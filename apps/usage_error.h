// What the command says to a command line that it does not understand.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// One line about what parse() refused: a word that nobody knows, with the nearest known one or why this build lacks
/// it, before anything that is missing or wrong besides.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace pictura
