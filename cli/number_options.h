// Options that take numbers, read by the one parser of numbers (common/support/numbers.h): CLI11's own takes 010 for
// octal, wraps -1, saturates 2^64, and lets NaN into any range.
#pragma once

#include <cstdint>
#include <limits>

#include <CLI/CLI.hpp>

namespace pictura {

constexpr uint64_t kMaxCount = std::numeric_limits<int>::max();

/// Takes whole numbers from low to high, both included, in any decimal notation. For Option::transform(): what CLI11
/// reads afterwards are the plain digits.
CLI::Validator whole_number(uint64_t low, uint64_t high = kMaxCount);

/// Takes finite numbers from low to high, both included. For Option::transform().
CLI::Validator number(double low, double high);

/// Adds --seed, any unsigned number of 64 bits.
CLI::Option* add_seed_option(CLI::App* command, uint64_t* seed_out, const std::string& help);

/// Adds --threads: 0, for all, to kMaxThreads.
CLI::Option* add_threads_option(CLI::App* command, int* num_threads_out);

}  // namespace pictura
