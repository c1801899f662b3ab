#include "pictura/cli/file_options.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

namespace fs = std::filesystem;

void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more) {
  command
      ->add_option(
          "MAP", *map_out,
          fmt::format(
              "A .xodr or .osm file, a town's name, procedural[:SEED], city[:SEED], the N-th affine copy of one "
              "of these (MAP#N), {}or a recorded scene: FILE.json, "
              "FILE.bin, FILE.scenario, FILE.tfrecord[#K] or FOLDER[#K], where K is a number or a scenario's id",
              more))
      ->check(input_file())
      ->required();
}

namespace {

// Names of the validators that mark options.
constexpr const char *kInput = "input file", *kOutput = "output file";

bool is_marked(CLI::Option* option, const char* mark) {
  try {
    option->get_validator(mark);
    return true;
  } catch (const CLI::OptionNotFound&) {
    return false;
  }
}

/// Returns the path of the regular file that a text names, even if it does not exist yet. Returns an empty text for
/// devices, folders and others.
std::string file_named(const std::string& text) {
  std::error_code error;
  const fs::file_status status = fs::status(text, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return "";
  return fs::weakly_canonical(fs::absolute(text, error), error).string();
}

/// Returns the texts that may be names of files in the value of an option for inputs: FILE, FILE#K,
/// FILE@LATITUDE,LONGITUDE, FILE=SHARE, or several of these, separated by commas.
std::vector<std::string> names_in(const std::string& value) {
  std::vector<std::string> names{value};
  for (const std::string& piece : CLI::detail::split(value, ',')) {
    names.push_back(piece);
    names.push_back(piece.substr(0, piece.find_last_of("#@=")));
  }
  return names;
}

/// Whether the path is the file or pipe behind stdout. Devices are not compared: /dev/null discards both outputs.
bool is_stdout(const std::string& path) {
  struct stat file{}, out{};
  return ::stat(path.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &out) == 0 && !S_ISCHR(out.st_mode) &&
         file.st_dev == out.st_dev && file.st_ino == out.st_ino;
}

void reject_shared_files(CLI::App* command) {
  std::map<std::string, std::string> name_of_file;  // key: file; value: name of the option
  const auto all = command->get_options();
  for (CLI::Option* const option : all) {
    if (!is_marked(option, kInput)) continue;
    for (const std::string& value : option->results()) {
      for (const std::string& name : names_in(value)) name_of_file.emplace(file_named(name), option->get_name());
    }
  }
  name_of_file.erase("");
  for (CLI::Option* const option : all) {
    if (!is_marked(option, kOutput)) continue;
    for (const std::string& text : option->results()) {
      const std::string file = file_named(text);
      if (file.empty()) continue;
      const auto [other, is_new] = name_of_file.emplace(file, option->get_name());
      if (!is_new) {
        fail_usage("{}: expected a file different from that of {}, got '{}'", option->get_name(), other->second, text);
      }
    }
  }
}

void check_outputs(CLI::App* command) {
  const CLI::Option* const json = command->get_option_no_throw("--json");
  const bool prints_json = json && json->count() > 0;
  const auto all = command->get_options();
  std::set<std::string> named;
  for (const CLI::Option* const option : all) {
    for (const std::string& text : option->results()) named.insert(file_named(text));
  }
  named.erase("");
  for (CLI::Option* const option : all) {
    if (!is_marked(option, kOutput)) continue;
    for (const std::string& text : option->results()) {
      if (prints_json && is_stdout(text)) {
        fail_usage("{}: expected a file other than stdout, where --json prints, got '{}'", option->get_name(), text);
      }
      if (!named.contains(fs::path(file_named(text)).parent_path().string())) const OutputFile opened(text);
    }
  }
}

}  // namespace

CLI::Validator input_file() {
  return CLI::Validator([](const std::string&) { return std::string(); }, "").name(kInput);
}

CLI::Validator output_file(const std::vector<std::string>& endings, Ending ending) {
  auto complaint = [endings, ending](const std::string& text) -> std::string {
    const std::string own = fs::path(text).extension().string();
    const bool is_known = std::find(endings.begin(), endings.end(), own) != endings.end();
    if (endings.empty() || is_known || (own.empty() && ending == Ending::optional)) return "";
    return fmt::format("expected a name that ends in {}, got '{}'", fmt::join(endings, " or "), text);
  };
  return CLI::Validator(complaint, "").name(kOutput);
}

void check_files(CLI::App* app) {
  reject_shared_files(app);
  for (CLI::App* const each : app->get_subcommands()) check_files(each);
  check_outputs(app);
}

OutputFolder::OutputFolder(const std::string& path) {
  std::error_code error;
  for (fs::path each = fs::absolute(path, error); !each.empty() && !fs::exists(each, error); each = each.parent_path())
    created_.push_back(each.string());
  make_output_folder(path);
}

OutputFolder::~OutputFolder() {
  std::error_code not_empty;
  for (const std::string& folder : created_) fs::remove(folder, not_empty);
}

void call_all(const std::vector<std::function<void()>>& functions) {
  std::exception_ptr first;
  for (const std::function<void()>& function : functions) {
    try {
      function();
    } catch (...) {
      if (!first) first = std::current_exception();
    }
  }
  if (first) std::rethrow_exception(first);
}

void reject_empty_values(CLI::App* command) {
  const auto complaint = [](const std::string& text) -> std::string {
    return text.empty() ? "expected a value, got an empty text" : "";
  };
  for (CLI::Option* option : command->get_options()) {
    if (option->get_items_expected_max() > 0) option->check(CLI::Validator(complaint, ""));
  }
  for (CLI::App* each : command->get_subcommands([](CLI::App*) { return true; })) reject_empty_values(each);
}

}  // namespace pictura
