// Conversion of CUDA runtime errors to Error.
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/common/error.h"

namespace pictura {

inline void check_cuda(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears the error, so that a later call does not report it again
  fail("cuda: {}: {}", what, cudaGetErrorString(status));
}

}  // namespace pictura

/// Throws Error naming the CUDA call if the call fails.
#define PICTURA_CUDA(call) ::pictura::check_cuda((call), #call)
