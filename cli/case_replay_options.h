// Options of `pictura probe` for the replay of a case.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/replay_cases.h"

namespace pictura {

/// Adds --replay, --case (with help `case_help`) and --cameras.
void add_case_replay_options(CLI::App* command, CaseReplayOptions* options_out, const std::string& case_help);

}  // namespace pictura
