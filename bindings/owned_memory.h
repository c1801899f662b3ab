// Memory of an extension module, on the host or on a device.
#pragma once

#include <vector>

#include "pictura/common/device.h"
#include "pictura/common/error.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#endif

namespace pictura::python {

class OwnedMemory {
 public:
  /// Returns the first byte; previous contents are lost. Throws Error for a device in builds without CUDA.
  uint8_t* allocate(size_t num_bytes, Device device, [[maybe_unused]] const char* what) {
    if (device.is_host()) {
      on_host_.resize(num_bytes);
      return on_host_.data();
    }
#ifdef PICTURA_HAS_CUDA
    const DeviceGuard guard(device);
    on_device_ = DeviceBuffer<uint8_t>(num_bytes);
    return on_device_.data();
#else
    fail("{}: this build has no CUDA", what);
#endif
  }

 private:
  std::vector<uint8_t> on_host_;
#ifdef PICTURA_HAS_CUDA
  DeviceBuffer<uint8_t> on_device_;
#endif
};

}  // namespace pictura::python
