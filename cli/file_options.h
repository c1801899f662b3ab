// Options that name files.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Returns a validator of file names, so that no file gets the ending of another format. It accepts names that end in
/// `ending` (such as .png), names that end in `other` (if it is not empty), and names without an ending, such as
/// /dev/null.
CLI::Validator file_ending(const std::string& ending, const std::string& other = "");

/// Adds the argument MAP, which may be a map or a recorded scene. `more` describes other kinds of MAP for the help.
void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more = "");

/// Throws UsageError if two options of a command write the same file, or if an option writes the policy or the rig that
/// another option reads. Several options may write to one device, such as /dev/null, and an option may replace the map
/// or scene that the command reads.
void reject_shared_files(const CLI::App& app);

/// Makes all options of a command and its subcommands reject empty texts, because an empty text would mean that the
/// option was not given.
void reject_empty_values(CLI::App* command);

}  // namespace pictura
