// What the rendering benchmark does on a CUDA device.
#pragma once

#include <atomic>
#include <thread>

#include <cuda_runtime_api.h>

#include "pictura/bench/render.h"

namespace pictura {

/// Times by events of the stream: the device's time, waits for the host between launches included.
std::unique_ptr<RenderTarget> make_device_target(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Device memory taken since its beginning, by whatever process: a thread asks cudaMemGetInfo all the time.
class DeviceMemoryWatch {
 public:
  DeviceMemoryWatch();
  ~DeviceMemoryWatch();
  DeviceMemoryWatch(const DeviceMemoryWatch&) = delete;
  DeviceMemoryWatch& operator=(const DeviceMemoryWatch&) = delete;

  double taken_bytes() const;
  /// What is taken now included. Throws Error when the thread could not ask.
  double max_bytes() const;

 private:
  std::size_t free_before_ = 0;
  std::atomic<double> max_bytes_ = 0;
  std::atomic<cudaError_t> status_ = cudaSuccess;
  std::atomic<bool> ends_ = false;
  std::thread poller_;
};

}  // namespace pictura
