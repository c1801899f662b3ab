// The drawing kernels as the host sees them: their handles, their memory, and their launches, which are put on a stream
// and do not wait.
#pragma once

#include <array>
#include <cstddef>

#include <cuda_runtime_api.h>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/backend_cuda/renderer/kernel_sources.h"

namespace pictura::cuda {

/// The kernels' handles: symbols of this program, or cudaKernel_t of code that was loaded.
struct KernelSet {
  std::array<const void*, kNumKernels> handle{};
  bool may_begin_early = false;  // whether a launch may begin while the one before it ends
};

/// The kernels that were compiled with this program, for any rig.
KernelSet ahead_of_time_kernels();
/// Must be called once before the first launch: loads the kernels and sets their attributes. Fails where they do not
/// run on the device.
cudaError_t prepare_kernels(KernelSet* kernels);

/// Bytes that a block of the last launch needs besides faces and edges.
std::size_t large_block_bytes(const Scratch& large);

/// Draws all images, in six launches.
cudaError_t launch_draw(const KernelSet& kernels, DrawTask task, const Scratch& large, int processors,
                        cudaStream_t stream);
cudaError_t launch_visibility(const KernelSet& kernels, const VisibilityTask& task, const Scratch& large,
                              cudaStream_t stream);

}  // namespace pictura::cuda
