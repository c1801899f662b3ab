// Host interface of the drawing kernels. Launches are asynchronous on a stream.
#pragma once

#include <array>
#include <cstddef>

#include <cuda_runtime_api.h>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/backend_cuda/renderer/kernel_sources.h"

namespace pictura::cuda {

/// Handles of the kernels: symbols of this program, or cudaKernel_t of loaded code.
struct KernelSet {
  std::array<const void*, kNumKernels> handle{};
  bool may_begin_early = false;  // a launch may begin before the previous launch ends
};

/// Returns the kernels compiled with this program, for any rig.
KernelSet ahead_of_time_kernels();
/// Loads the kernels. Callers call it once before the first launch. Fails if the kernels do not run on the device.
cudaError_t prepare_kernels(KernelSet* kernels);

/// Returns the bytes of a block of the overflow launch, without faces and edges.
std::size_t large_block_bytes(const Scratch& large);

cudaError_t launch_draw(const KernelSet& kernels, DrawTask task, const Scratch& large, int processors,
                        cudaStream_t stream);
cudaError_t launch_visibility(const KernelSet& kernels, const VisibilityTask& task, const Scratch& large,
                              cudaStream_t stream);

}  // namespace pictura::cuda
