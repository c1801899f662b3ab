// Options of commands that record replays.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/recording.h"

namespace pictura {

/// Adds --follow and --cameras.
void add_recording_options(CLI::App* command, RecordingOptions* options_out);
/// Adds --cameras alone, for replays whose followed agent is fixed.
CLI::Option* add_cameras_option(CLI::App* command, RecordingOptions* options_out);
/// Throws UsageError if the command was given one of these options, which have no effect without `needed`.
void reject_recording_options(const CLI::App& command, const std::string& needed);

}  // namespace pictura
