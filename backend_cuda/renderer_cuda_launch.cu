// The drawing kernels compiled ahead of time, and the launches of whatever kernels the renderer has.
#include "pictura/backend_cuda/renderer_cuda_kernel.cuh"
#include "pictura/backend_cuda/renderer_cuda_launch.h"

namespace pictura::cuda {

namespace {

template <typename Task>
cudaError_t launch(const void* kernel, int blocks, std::size_t shared_bytes, const Task& task, const Scratch& scratch,
                   cudaStream_t stream) {
  void* arguments[] = {const_cast<Task*>(&task), const_cast<Scratch*>(&scratch)};
  return cudaLaunchKernel(kernel, dim3(static_cast<unsigned>(blocks)), dim3(kThreads), arguments, shared_bytes, stream);
}

}  // namespace

KernelSet ahead_of_time_kernels() {
  return {reinterpret_cast<const void*>(pictura_draw), reinterpret_cast<const void*>(pictura_draw_overflow),
          reinterpret_cast<const void*>(pictura_visibility)};
}

cudaError_t prepare_kernels(const KernelSet& kernels) {
  return cudaFuncSetAttribute(kernels.draw, cudaFuncAttributeMaxDynamicSharedMemorySize,
                              static_cast<int>(small_bytes()));
}

Scratch small_scratch(int processors) {
  Scratch scratch = small_sizes();
  scratch.blocks = kSmallBlocksPerProcessor * processors;
  return scratch;
}

std::size_t block_bytes(const Scratch& large) { return large_bytes(large); }

cudaError_t launch_draw(const KernelSet& kernels, const DrawTask& task, const Scratch& small, const Scratch& large,
                        cudaStream_t stream) {
  const int images = task.num_views * task.num_cameras;
  const cudaError_t status = launch(kernels.draw, min_of(images, small.blocks), small_bytes(), task, small, stream);
  if (status != cudaSuccess) return status;
  return launch(kernels.draw_overflow, min_of(images, large.blocks), kStateBytes, task, large, stream);
}

cudaError_t launch_visibility(const KernelSet& kernels, const VisibilityTask& task, const Scratch& large,
                              cudaStream_t stream) {
  if (task.num_queries == 0) return cudaSuccess;
  return launch(kernels.visibility, min_of(task.num_queries, large.blocks), kStateBytes, task, large, stream);
}

}  // namespace pictura::cuda
