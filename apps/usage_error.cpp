#include "pictura/apps/usage_error.h"

#include <map>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/support/suggestion.h"

namespace pictura {

namespace {

// Returns the build option that each optional subcommand needs. It is used only for subcommands that this build lacks.
const std::map<std::string, std::string>& needs_of_commands() {
  static const std::map<std::string, std::string> kNeeds = [] {
    std::map<std::string, std::string> needs;
    for (const char* name : {"simulate", "quality", "render", "worlds", "soak", "history"}) {
      needs[fmt::format("pictura bench {}", name)] = "benchmarks (PICTURA_BUILD_BENCH)";
    }
    const std::string torch = "torch: pip install 'pictura[train]', or build with PICTURA_WITH_TORCH=ON";
    needs["pictura train"] = needs["pictura bench train"] = torch;
    needs["pictura bench breakdown"] = torch + "; or no benchmarks (PICTURA_BUILD_BENCH)";
    return needs;
  }();
  return kNeeds;
}

std::vector<std::string> known_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> known_commands(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* each : command.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(each->get_name());
  }
  return names;
}

}  // namespace

std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  std::string name = app.get_name();
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += " " + command->get_name();
  }
  const std::string see = fmt::format("(see {} --help)", name);
  // The parent command has the unknown words of its subcommands.
  const std::vector<std::string> unknown = app.remaining(/*recurse=*/true);
  if (unknown.empty()) return fmt::format("{} {}", error.what(), see);
  const std::string& word = unknown.front();
  if (word.starts_with('-')) {
    const std::string option = word.substr(0, word.find('='));
    return fmt::format("{}: unknown option '{}'{} {}", name, option, suggestion(option, known_options(*command)), see);
  }
  const std::vector<std::string> commands = known_commands(*command);
  if (commands.empty()) return fmt::format("{}: unexpected argument '{}' {}", name, word, see);
  const std::map<std::string, std::string>& needs = needs_of_commands();
  if (const auto found = needs.find(name + " " + word); found != needs.end()) {
    return fmt::format("{}: this build has no {}", found->first, found->second);
  }
  return fmt::format("{}: unknown subcommand '{}'{} {}", name, word, suggestion(word, commands), see);
}

}  // namespace pictura
