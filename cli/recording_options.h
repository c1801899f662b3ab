// Options of replay recordings.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/recording.h"

namespace pictura {

/// Adds --follow and --cameras.
void add_recording_options(CLI::App* command, RecordingOptions* options_out);
/// Adds only --cameras.
CLI::Option* add_cameras_option(CLI::App* command, RecordingOptions* options_out);
/// Throws UsageError if one of these options was given without the option `needed`.
void reject_recording_options(const CLI::App& command, const std::string& needed);

/// Writes a recording as a page and as an MCAP file, each unless its path is empty, and reports the files on stderr.
/// Throws Error after trying both if one cannot be written.
void write_replay_files(const Replay& replay, const std::string& page, const std::string& mcap);

}  // namespace pictura
