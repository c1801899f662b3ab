// Devices and streams, without CUDA headers.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

enum class MemorySpace : uint8_t { host, cuda };

/// Host memory, or the memory of one CUDA device.
struct Device {
  MemorySpace space = MemorySpace::host;
  int32_t index = 0;  // CUDA's device index; 0 on the host
  bool operator==(const Device&) const = default;
  PICTURA_HD constexpr bool is_host() const { return space == MemorySpace::host; }
};

/// A cudaStream_t. On the host, the handle is null and calls are synchronous.
struct Stream {
  void* handle = nullptr;
};

}  // namespace pictura
