// Options that take numbers. The parser of common/support/numbers.h reads them, because CLI11's own parser reads 010 as
// octal, wraps -1, saturates 2^64, and accepts NaN in any range.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include <CLI/CLI.hpp>

namespace pictura {

constexpr uint64_t kMaxCount = std::numeric_limits<int>::max();

/// Returns a validator that accepts whole numbers from low to high, inclusive, in any decimal notation. Pass it to
/// Option::transform(), so that CLI11 reads only plain digits.
CLI::Validator whole_number(uint64_t low, uint64_t high = kMaxCount);

/// Returns a validator that accepts finite numbers from low to high, inclusive. Pass it to Option::transform().
CLI::Validator number(double low, double high);

/// Adds an option that takes a number from low to high, which must be whole if T is an integer type. The help shows the
/// initial `value` as the default. A default out of range means "not given", and the help does not show it.
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

/// Adds --seed, any unsigned 64-bit number.
CLI::Option* add_seed_option(CLI::App* command, uint64_t* seed_out, const std::string& help);

/// Adds --threads, from 0 (all processors) to kMaxThreads.
CLI::Option* add_threads_option(CLI::App* command, int* num_threads_out);

}  // namespace pictura
