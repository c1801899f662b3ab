// Options that name files.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Accepts names that end in `ending` (such as .png) or in a non-empty `other`, and names without an ending, such as
/// /dev/null.
CLI::Validator file_ending(const std::string& ending, const std::string& other = "");

/// Adds the argument MAP. `more` adds kinds of MAP to the help.
void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more = "");

/// Throws UsageError if two options write the same file, or one writes the policy or rig that another reads. Several
/// options may write to one device, such as /dev/null. An option may replace the map or scene that the command reads.
void reject_shared_files(const CLI::App& app);

/// Makes all options of a command and its subcommands reject empty texts, which would mean "not given".
void reject_empty_values(CLI::App* command);

}  // namespace pictura
