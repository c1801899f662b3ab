#include "pictura/cli/file_options.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "pictura/common/error.h"

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
      ->required();
}

CLI::Validator file_ending(const std::string& ending, const std::string& other) {
  auto complaint = [ending, other](const std::string& text) -> std::string {
    const std::string own = fs::path(text).extension().string();
    if (own.empty() || own == ending || own == other) return "";
    return fmt::format("expected a name that ends in {}{}{}, got '{}'", ending, other.empty() ? "" : " or ", other,
                       text);
  };
  return {complaint, ""};
}

namespace {

constexpr std::array kOutputs{"--out",      "--csv",   "--infractions", "--mcap",  "--png", "--replay",
                              "--rollouts", "--scene", "--svg",         "--video", "--xodr"};
constexpr std::array kInputs{"CHECKPOINT", "POLICY", "--policy", "--rig"};

template <typename Names>
bool is_among(const Names& names, const CLI::Option* option) {
  return std::find(names.begin(), names.end(), option->get_name()) != names.end();
}

/// Returns the path of the regular file that a text names, even if it does not exist yet. Returns an empty text for
/// devices, folders and others.
std::string file_named(const std::string& text) {
  std::error_code error;
  const fs::file_status status = fs::status(text, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return "";
  return fs::weakly_canonical(fs::absolute(text, error), error).string();
}

}  // namespace

void reject_shared_files(const CLI::App& app) {
  std::map<std::string, std::string> name_of_file;  // key: file; value: name of the option
  for (const bool writes : {false, true}) {
    for (const CLI::Option* option : app.get_options()) {
      if (writes ? !is_among(kOutputs, option) : !is_among(kInputs, option)) continue;
      for (const std::string& text : option->results()) {
        const std::string file = file_named(text);
        if (file.empty()) continue;
        const auto [other, is_new] = name_of_file.emplace(file, option->get_name());
        if (!is_new && writes) {
          fail_usage("{}: expected a file different from that of {}, got '{}'", option->get_name(), other->second,
                     text);
        }
      }
    }
  }
  for (const CLI::App* each : app.get_subcommands()) reject_shared_files(*each);
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
