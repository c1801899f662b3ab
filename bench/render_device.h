// Parts of the rendering benchmark for CUDA devices.
#pragma once

#include <atomic>
#include <thread>

#include <cuda_runtime_api.h>

#include "pictura/bench/render.h"

namespace pictura {

/// The target measures time with events, including the device's waits for the host.
std::unique_ptr<RenderTarget> make_device_target(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Measures the device memory that all processes have allocated since construction. A thread polls it.
class DeviceMemoryMeter {
 public:
  DeviceMemoryMeter();
  ~DeviceMemoryMeter();
  DeviceMemoryMeter(const DeviceMemoryMeter&) = delete;
  DeviceMemoryMeter& operator=(const DeviceMemoryMeter&) = delete;

  double used_bytes() const;
  /// Throws Error if polling failed.
  double max_bytes() const;

 private:
  std::size_t free_before_ = 0;
  std::atomic<double> max_bytes_ = 0;
  std::atomic<cudaError_t> status_ = cudaSuccess;
  std::atomic<bool> stops_ = false;
  std::thread poller_;
};

}  // namespace pictura
