// Profile of the kernels that ran on a CUDA device, by torch's profiler (CUPTI). Without torch headers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pictura {

struct KernelTime {
  std::string name;  // of the kernel, or of a kind of copy
  int64_t launches = 0;
  double seconds = 0;
};

/// Profile of what runs between begin() and end(), which becomes a few per cent slower. One at a time in a process.
class KernelProfile {
 public:
  static void begin();
  /// Kernels by descending time; empty where nothing ran on a CUDA device. Waits for the device.
  static std::vector<KernelTime> end();
};

}  // namespace pictura
