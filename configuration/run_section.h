// Section [run] of a configuration.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pictura {

/// Names of learning devices. N has at most three digits.
inline constexpr const char* kDevices = "cpu, cuda, cuda:N, auto";
bool is_device(std::string_view text);

struct RunSection {
  uint64_t seed = 1;
  int num_threads = 0;          // threads of simulator, renderer and torch; 0: all
  std::string device = "auto";  // learning device: see kDevices
};

}  // namespace pictura
