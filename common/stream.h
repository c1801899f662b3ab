// Where memory lives and the queue that work is put on, without any CUDA header.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

enum class MemorySpace : uint8_t { host, cuda };

/// A cudaStream_t in disguise; null on the host, where work is done when the call returns.
struct Stream {
  void* handle = nullptr;
};

}  // namespace pictura
