#include "pictura/cli/number_options.h"

#include <fmt/format.h>

#include "pictura/common/support/numbers.h"
#include "pictura/common/support/parallel_for.h"

namespace pictura {

CLI::Validator whole_number(uint64_t low, uint64_t high) {
  auto complaint = [low, high](std::string& text) -> std::string {
    const std::optional<uint64_t> value = parse_unsigned(text);
    if (!value || *value < low || *value > high) {
      return fmt::format("expected a whole number of {} to {}, got '{}'", low, high, text);
    }
    text = fmt::format("{}", *value);
    return "";
  };
  return {complaint, fmt::format("{} to {}", low, high)};
}

CLI::Validator number(double low, double high) {
  auto complaint = [low, high](std::string& text) -> std::string {
    const std::optional<double> value = parse_number(text);
    if (!value || *value < low || *value > high) {
      return fmt::format("expected a number of {} to {}, got '{}'", text_of_number(low), text_of_number(high), text);
    }
    text = fmt::format("{}", *value);
    return "";
  };
  return {complaint, fmt::format("{} to {}", text_of_number(low), text_of_number(high))};
}

CLI::Option* add_seed_option(CLI::App* command, uint64_t* seed_out, const std::string& help) {
  return command->add_option("--seed", *seed_out, help)
      ->transform(whole_number(0, std::numeric_limits<uint64_t>::max()))
      ->capture_default_str();
}

CLI::Option* add_threads_option(CLI::App* command, int* num_threads_out) {
  return add_number_option(command, "--threads", *num_threads_out, "Number of CPU threads; 0: all", 0, kMaxThreads);
}

}  // namespace pictura
