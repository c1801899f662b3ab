// Profile of the kernels that ran on a CUDA device, by torch's profiler (CUPTI). Has no torch headers.
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

/// Profile of the work between begin() and end(), which becomes a few per cent slower. One profile at a time in a
/// process.
class KernelProfile {
 public:
  static void begin();
  /// Kernels by descending time; empty if nothing ran on a CUDA device. Waits for the device.
  static std::vector<KernelTime> end();
};

}  // namespace pictura
