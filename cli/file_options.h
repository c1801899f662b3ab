// Options that name files.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Validator that accepts names that end in `ending`, such as .png, or in `other`, if it is given, and names without
/// ending, such as devices. So no file gets the ending of another format.
CLI::Validator file_ending(const std::string& ending, const std::string& other = "");

/// Adds MAP, which may be a recorded scene; `more` names further kinds.
void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more = "");

/// Rejects a command if two of its options write the same file, or one option writes the policy or the rig that another
/// option reads. Devices may be shared; maps and scenes may be replaced.
void reject_shared_files(const CLI::App& app);

/// Rejects empty texts for all options of a command and its subcommands, since an empty text would count as not given.
void reject_empty_values(CLI::App* command);

}  // namespace pictura
