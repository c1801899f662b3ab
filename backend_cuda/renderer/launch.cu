// The drawing kernels compiled ahead of time, and the launches of these kernels or of kernels compiled at run time.
#include <utility>

#include "pictura/backend_cuda/renderer/kernels.cuh"
#include "pictura/backend_cuda/renderer/launch.h"

namespace pictura::cuda {

namespace {

struct LaunchShape {
  int blocks, threads;
  std::size_t shared_bytes;
};

// Stream of launches, and whether a launch may begin before the previous launch has ended.
struct LaunchPlace {
  cudaStream_t stream;
  bool may_begin_early;
};

template <typename... Arguments>
cudaError_t launch(const void* kernel, LaunchShape shape, LaunchPlace place, const Arguments&... arguments) {
  void* pointers[] = {const_cast<Arguments*>(&arguments)...};
  cudaLaunchAttribute attribute{};
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(shape.blocks));
  config.blockDim = dim3(static_cast<unsigned>(shape.threads));
  config.dynamicSmemBytes = shape.shared_bytes;
  config.stream = place.stream;
  config.attrs = &attribute;
  config.numAttrs = place.may_begin_early ? 1 : 0;
  return cudaLaunchKernelExC(&config, kernel, pointers);
}

cudaError_t allow_shared(const void* kernel, std::size_t bytes) {
  return cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes));
}

}  // namespace

KernelSet ahead_of_time_kernels() {
  return {{reinterpret_cast<const void*>(pictura_cull), reinterpret_cast<const void*>(pictura_setup_faces),
           reinterpret_cast<const void*>(pictura_clip), reinterpret_cast<const void*>(pictura_draw),
           reinterpret_cast<const void*>(pictura_draw_deferred), reinterpret_cast<const void*>(pictura_draw_overflow),
           reinterpret_cast<const void*>(pictura_visibility)}};
}

cudaError_t prepare_kernels(KernelSet* kernels) {
  // All kernels are queried, because code that is loaded at its first launch would be loaded during the capture of a
  // graph.
  cudaFuncAttributes attributes{};
  for (const void* kernel : kernels->handle) {
    const cudaError_t status = cudaFuncGetAttributes(&attributes, kernel);
    if (status != cudaSuccess) return status;
  }
  // Kernels of compute capability 9.0 or newer wait for the previous launch, see wait_for_earlier_launch.
  kernels->may_begin_early = attributes.ptxVersion >= 90;
  const cudaError_t allowed = allow_shared(kernels->handle[kDraw], draw_bytes());
  return allowed != cudaSuccess ? allowed : allow_shared(kernels->handle[kDrawDeferred], deferred_bytes());
}

std::size_t large_block_bytes(const Scratch& large) { return large_bytes(large); }

cudaError_t launch_draw(const KernelSet& kernels, DrawTask task, const Scratch& large, int processors,
                        cudaStream_t stream) {
  const LaunchPlace place{stream, kernels.may_begin_early};
  const int images = task.num_views * task.num_cameras, draw_blocks = kDrawBlocksPerProcessor * processors;
  choose_tiles(&task, draw_blocks);
  const int deferred_blocks = setup_blocks(task.pool, min_of(images, kDeferredBlocksPerProcessor * processors));
  const std::pair<Kernel, LaunchShape> launches[] = {
      {kCull, {min_of(images, kCullBlocksPerProcessor * processors), kSetupThreads, cull_bytes()}},
      {kSetupFaces, {kFaceSetupBlocksPerProcessor * processors, kSetupThreads, sizeof(FaceSetupState)}},
      {kClip, {kClipBlocksPerProcessor * processors, kSetupThreads, setup_bytes(kSetupThreads)}},
      {kDraw, {min_of(images * task.max_tiles, draw_blocks), kDrawThreads, draw_bytes()}},
      {kDrawDeferred, {deferred_blocks, kDrawThreads, deferred_bytes()}}};
  for (const auto& [kernel, shape] : launches) {
    const cudaError_t status = launch(kernels.handle[kernel], shape, place, task);
    if (status != cudaSuccess) return status;
  }
  return launch(kernels.handle[kDrawOverflow],
                {min_of(images, large.blocks), kLargeThreads, setup_bytes(kLargeThreads)}, place, task, large);
}

cudaError_t launch_visibility(const KernelSet& kernels, const VisibilityTask& task, const Scratch& large,
                              cudaStream_t stream) {
  if (task.num_queries == 0) return cudaSuccess;
  return launch(kernels.handle[kVisibility],
                {min_of(task.num_queries, large.blocks), kLargeThreads, setup_bytes(kLargeThreads)},
                LaunchPlace{stream, kernels.may_begin_early}, task, large);
}

}  // namespace pictura::cuda
