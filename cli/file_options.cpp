#include "pictura/cli/file_options.h"

#include <filesystem>

#include <fmt/format.h>

namespace pictura {

void add_map_or_scene(CLI::App* command, std::string* map_out, const std::string& more) {
  command
      ->add_option("MAP", *map_out,
                   fmt::format("A .xodr file, a town's name, procedural[:SEED], the N-th affine copy of one of these "
                               "(MAP#N), {}or a recorded scene: FILE.json, "
                               "FILE.bin, FILE.scenario, FILE.tfrecord[#K] or FOLDER[#K], with a number or a "
                               "scenario's id as K",
                               more))
      ->required();
}

CLI::Validator file_ending(const std::string& ending, const std::string& other) {
  auto complaint = [ending, other](const std::string& text) -> std::string {
    const std::string own = std::filesystem::path(text).extension().string();
    if (own.empty() || own == ending || own == other) return "";
    return fmt::format("expected a name that ends in {}{}{}, got '{}'", ending, other.empty() ? "" : " or ", other,
                       text);
  };
  return {complaint, ""};
}

void refuse_empty_values(CLI::App* command) {
  const auto complaint = [](const std::string& text) -> std::string {
    return text.empty() ? "expected a value, got an empty text" : "";
  };
  for (CLI::Option* option : command->get_options()) {
    if (option->get_items_expected_max() > 0) option->check(CLI::Validator(complaint, ""));
  }
  for (CLI::App* each : command->get_subcommands([](CLI::App*) { return true; })) refuse_empty_values(each);
}

}  // namespace pictura
