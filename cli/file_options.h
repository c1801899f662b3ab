// Options that name files.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pictura {

/// Takes names that end in `ending`, as .png, or in `other`, if there is one, or in none at all, as devices do: no
/// other format is written under a name that promises it.
CLI::Validator file_ending(const std::string& ending, const std::string& other = "");

/// Adds MAP, which may be a recorded scene; `more` names what else it may be.
void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more = "");

/// Refuses a command two of whose options write the same file, or one of which writes the policy or the rig that
/// another reads. Devices may be shared; maps and scenes may be replaced.
void refuse_shared_files(const CLI::App& app);

/// Lets no option of a command and its subcommands take an empty text, which would count as not given.
void refuse_empty_values(CLI::App* command);

}  // namespace pictura
