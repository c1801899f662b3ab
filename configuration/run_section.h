// Section [run] of a configuration.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

struct RunSection {
  uint64_t seed = 1;
  int num_threads = 0;          // threads of simulator, renderer and torch; 0: all
  std::string device = "auto";  // learning device: cpu, cuda, cuda:N or auto
};

}  // namespace pictura
