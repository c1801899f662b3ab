// Profile of the kernels that ran on a CUDA device, by torch's profiler (CUPTI). Includes no torch headers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pictura {

struct KernelTime {
  std::string name;  // name of the kernel, or of a kind of copy
  int64_t launches = 0;
  double seconds = 0;
};

/// Profile of the work between begin() and end(). Profiling slows this work down by a few per cent. A process can have
/// only one profile at a time.
class KernelProfile {
 public:
  static void begin();
  /// Returns the kernels in the order of descending time; empty if nothing ran on a CUDA device. Waits for the device.
  static std::vector<KernelTime> end();
};

}  // namespace pictura
