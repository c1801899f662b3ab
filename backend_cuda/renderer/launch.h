// Host interface of the drawing kernels: their handles, their memory, and their launches, which are asynchronous on a
// stream.
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
  bool may_begin_early = false;  // whether a launch may begin before the previous launch has ended
};

/// Returns the kernels that were compiled with this program, for any rig.
KernelSet ahead_of_time_kernels();
/// Loads the kernels and sets their attributes. Must be called once before the first launch. Fails if the kernels do
/// not run on the device.
cudaError_t prepare_kernels(KernelSet* kernels);

/// Returns the bytes that a block of the overflow launch (the last of launch_draw()) needs besides faces and edges.
std::size_t large_block_bytes(const Scratch& large);

/// Draws all images, in six launches.
cudaError_t launch_draw(const KernelSet& kernels, DrawTask task, const Scratch& large, int processors,
                        cudaStream_t stream);
cudaError_t launch_visibility(const KernelSet& kernels, const VisibilityTask& task, const Scratch& large,
                              cudaStream_t stream);

}  // namespace pictura::cuda
