// Profile of CUDA kernels by torch's profiler (CUPTI). Includes no torch headers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pictura {

struct KernelTime {
  std::string name;  // kernel, or kind of copy
  int64_t launches = 0;
  double seconds = 0;
};

/// Profile of the work between begin() and end(). Profiling makes the work a few per cent slower. A process can have
/// only one profile at a time.
class KernelProfile {
 public:
  static void begin();
  /// Returns kernels, slowest first; empty without work on a CUDA device. Waits for the device.
  static std::vector<KernelTime> end();
};

}  // namespace pictura
