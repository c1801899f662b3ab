// What the simulator's host side asks of its kernels. All of it is put on a stream and waits for nothing; what goes
// wrong, cudaGetLastError() tells.
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/backend_cuda/simulator_cuda_phases.h"

namespace pictura::cuda {

void launch_reset(const SimulatorArrays& arrays, cudaStream_t stream);
void launch_restored(const SimulatorArrays& arrays, cudaStream_t stream);
void launch_step(const SimulatorArrays& arrays, const int32_t* actions, cudaStream_t stream);

}  // namespace pictura::cuda
