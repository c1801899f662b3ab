// How long each kernel took while something ran on a CUDA device, by torch's profiler (CUPTI). Without torch headers.
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

/// One at a time in a process. What is timed between the two calls becomes a few per cent slower.
class KernelProfile {
 public:
  static void begin();
  /// Waits for the device. By descending time; empty where nothing ran on a CUDA device.
  static std::vector<KernelTime> end();
};

}  // namespace pictura
