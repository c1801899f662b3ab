// Command-line flags for the options that visit_options() lists.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/cli/backend_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/common/span.h"
#include "pictura/common/support/named_option.h"
#include "pictura/common/support/suggestion.h"

namespace pictura {

/// Adds a flag for each visited option.
class FlagAdder {
 public:
  explicit FlagAdder(CLI::App* command) : command_(command) {}

  template <typename T>
  void value(const NamedOption& option, T& value) {
    add_number_option(command_, option.flag, value, option.help, option.low, option.high);
  }
  void name(const NamedOption& option, std::string& value, const std::vector<std::string>& names) {
    command_->add_option(option.flag, value, option.help)->check(one_of(names));
  }
  template <typename Enum>
  void choice(const NamedOption& option, Enum& value, Span<const char* const> names) {
    const auto choose = [&value, names, name = option.name](const std::string& chosen) {
      value = static_cast<Enum>(index_of_word(name, chosen, names));
    };
    CLI::Option* const added = command_->add_option_function<std::string>(option.flag, choose, option.help)
                                   ->check(one_of({names.begin(), names.end()}))
                                   ->default_str(names[static_cast<int>(value)]);
    if (option.renamed.old_name) added->transform(renaming(option.flag, option.renamed));
  }

 private:
  CLI::App* command_;
};

}  // namespace pictura
