// Options that take numbers, parsed by common/support/numbers.h. CLI11's own parser reads 010 as octal, wraps -1,
// saturates 2^64, and accepts NaN.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include <CLI/CLI.hpp>

namespace pictura {

constexpr uint64_t kMaxCount = std::numeric_limits<int>::max();

/// Accepts whole numbers from low to high, inclusive, in any decimal notation. Pass it to Option::transform(), which
/// gives CLI11 plain digits.
CLI::Validator whole_number(uint64_t low, uint64_t high = kMaxCount);

/// Accepts finite numbers from low to high, inclusive. Pass it to Option::transform().
CLI::Validator number(double low, double high);

/// Adds a number from low to high, whole if T is an integer type. The help shows `value` as the default unless it is
/// out of range, which means "not given".
template <typename T>
CLI::Option* add_number_option(CLI::App* command, const std::string& flag, T& value, const std::string& help,
                               double low, double high = kMaxCount) {
  CLI::Option* const option = command->add_option(flag, value, help);
  constexpr bool kIsReal = std::is_floating_point_v<T> || std::is_same_v<T, std::optional<float>>;
  option->transform(kIsReal ? number(low, high)
                            : whole_number(static_cast<uint64_t>(low), static_cast<uint64_t>(high)));
  if constexpr (std::is_arithmetic_v<T>) {
    if (static_cast<double>(value) >= low && static_cast<double>(value) <= high) option->capture_default_str();
  }
  return option;
}

CLI::Option* add_seed_option(CLI::App* command, uint64_t* seed_out, const std::string& help);

/// Adds --threads; 0: all processors.
CLI::Option* add_threads_option(CLI::App* command, int* num_threads_out);

}  // namespace pictura
