// Options of commands that record replays.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/recording.h"

namespace pictura {

/// Adds --follow and --cameras.
void add_recording_options(CLI::App* command, RecordingOptions* options_out);
/// Adds only --cameras, for replays whose followed agent cannot be chosen.
CLI::Option* add_cameras_option(CLI::App* command, RecordingOptions* options_out);
/// Throws UsageError if one of these options was given, because they have no effect without the option `needed`.
void reject_recording_options(const CLI::App& command, const std::string& needed);

}  // namespace pictura
