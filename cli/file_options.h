// Options that name files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

/// Marks an option that names files or folders which the command reads. Suffixes, as in FILE#K and FILE=SHARE, are
/// permitted.
CLI::Validator input_file();

/// Whether names without an ending, such as /dev/null, are rejected.
enum class Ending { optional, required };

/// Marks an option that names a file which the command writes. Accepts names with one of the endings (such as .png; if
/// empty, with any), and others as `ending` says.
CLI::Validator output_file(const std::vector<std::string>& endings = {}, Ending ending = Ending::optional);

/// Adds the argument MAP. `more` adds kinds of MAP to the help.
void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more = "");

/// Checks the files of the parsed command before it runs. Throws UsageError if two options write the same file, if one
/// writes a file that another reads, or if a file is stdout, where --json prints. Several options may write to one
/// device, such as /dev/null. Throws Error if a file cannot be written, except in a folder that another option names,
/// because the command may create that folder.
void check_files(CLI::App* app);

/// Folder that a command fills. The destructor removes it, with the parents that were created, if it is still empty.
class OutputFolder {
 public:
  /// Creates the folder. Throws Error as make_output_folder() does.
  explicit OutputFolder(const std::string& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

 private:
  std::vector<std::string> created_;  // innermost first
};

/// Calls each function, even if another one throws, so that no output is lost because of another. Then throws the first
/// exception.
void call_all(const std::vector<std::function<void()>>& functions);

/// Makes all options of a command and its subcommands reject empty texts, which would mean "not given".
void reject_empty_values(CLI::App* command);

}  // namespace pictura
