// `pictura completion`: prints scripts for shell completion.
#include "pictura/cli/completion.h"

#include "pictura/apps/commands.h"
#include "pictura/cli/report.h"

namespace pictura {

void add_completion_command(CLI::App& app) {
  auto shell = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("completion", "Print a shell script that completes commands and options");
  command->add_option("SHELL", *shell, "bash, zsh or fish")->required();
  command->footer(
      "Examples:\n  source <(pictura completion bash)\n"
      "  pictura completion zsh > ~/.zfunc/_pictura\n"
      "  pictura completion fish > ~/.config/fish/completions/pictura.fish");
  command->callback([shell, &app] { print_result("{}", completion_script(app, *shell)); });
}

}  // namespace pictura
