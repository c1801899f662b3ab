// The current CUDA device of a thread.
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/common/array.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/error.h"

namespace pictura {

/// Makes a device the thread's current device until the end of the scope.
class DeviceGuard {
 public:
  /// Throws Error unless the device is an existing CUDA device.
  explicit DeviceGuard(Device device) : index_(device.index) {
    PICTURA_CHECK(!device.is_host(), "cuda: expected a CUDA device, got {}", name_of(device));
    PICTURA_CUDA(cudaGetDevice(&previous_));
    if (index_ == previous_) return;
    if (const cudaError_t status = cudaSetDevice(index_); status != cudaSuccess) {
      cudaGetLastError();  // clears the error
      fail("{}: {}", name_of(device), cudaGetErrorString(status));
    }
  }
  ~DeviceGuard() {
    if (index_ != previous_) cudaSetDevice(previous_);
  }
  DeviceGuard(const DeviceGuard&) = delete;
  DeviceGuard& operator=(const DeviceGuard&) = delete;

 private:
  int index_ = 0, previous_ = 0;
};

inline Device current_device() {
  Device device{MemorySpace::cuda, 0};
  PICTURA_CUDA(cudaGetDevice(&device.index));
  return device;
}

}  // namespace pictura
