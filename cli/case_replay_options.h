// Options of probes that write a case as a replay.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/replay_cases.h"

namespace pictura {

/// Adds --replay, --case with its help, and --cameras.
void add_case_replay_options(CLI::App* command, CaseReplayOptions* options_out, const std::string& case_help);

}  // namespace pictura
