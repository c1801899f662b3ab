// Options that take numbers, read by the one parser of numbers (common/support/numbers.h): CLI11's own takes 010 for
// octal, wraps -1, saturates 2^64, and lets NaN into any range.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include <CLI/CLI.hpp>

namespace pictura {

constexpr uint64_t kMaxCount = std::numeric_limits<int>::max();

/// Takes whole numbers from low to high, both included, in any decimal notation. For Option::transform(): what CLI11
/// reads afterwards are the plain digits.
CLI::Validator whole_number(uint64_t low, uint64_t high = kMaxCount);

/// Takes finite numbers from low to high, both included. For Option::transform().
CLI::Validator number(double low, double high);

/// Adds an option that takes numbers from low to high, whole ones for an integer. The help has the default unless there
/// is none, or one out of range, which stands for nothing given.
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

/// Adds --seed, any unsigned number of 64 bits.
CLI::Option* add_seed_option(CLI::App* command, uint64_t* seed_out, const std::string& help);

/// Adds --threads: 0, for all, to kMaxThreads.
CLI::Option* add_threads_option(CLI::App* command, int* num_threads_out);

}  // namespace pictura
