// Conversion of CUDA runtime errors to Error.
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/common/error.h"

namespace pictura {

inline void check_cuda(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears the error, so that no later call reports it
  fail("cuda: {}: {}", what, cudaGetErrorString(status));
}

}  // namespace pictura

/// Throws Error naming the CUDA call if it fails.
#define PICTURA_CUDA(call) ::pictura::check_cuda((call), #call)
