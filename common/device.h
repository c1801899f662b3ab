// Where memory lives, and the queue that work on it is put on, without any CUDA header.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

enum class MemorySpace : uint8_t { host, cuda };

/// A memory that arrays lie in: the host's, or that of one CUDA device.
struct Device {
  MemorySpace space = MemorySpace::host;
  int32_t index = 0;  // CUDA's number of the device; 0 on the host
  bool operator==(const Device&) const = default;
  PICTURA_HD constexpr bool is_host() const { return space == MemorySpace::host; }
};

/// A cudaStream_t without CUDA's headers; null on the host, where work is done when the call returns.
struct Stream {
  void* handle = nullptr;
};

}  // namespace pictura
