// Errors of the CUDA runtime as Error.
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/common/error.h"

namespace pictura {

inline void check_cuda(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // reported here; a later call must not report it again
  fail("cuda: {}: {}", what, cudaGetErrorString(status));
}

}  // namespace pictura

/// Throws Error naming the call when it fails.
#define PICTURA_CUDA(call) ::pictura::check_cuda((call), #call)

namespace pictura {

/// The CUDA device that was current when this object was made.
class CurrentDevice {
 public:
  CurrentDevice() { PICTURA_CUDA(cudaGetDevice(&number_)); }
  int number() const { return number_; }
  /// Throws Error where another device is current now.
  void check_current(const char* who) const {
    const int current = CurrentDevice().number_;
    PICTURA_CHECK(current == number_, "{}: made for device {}, called with device {} current", who, number_, current);
  }

 private:
  int number_ = 0;
};

}  // namespace pictura
