#include "pictura/backend_cuda/renderer/kernel_library.h"

#include "pictura/backend_cuda/renderer/kernel_build.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/error.h"

namespace pictura::cuda {

namespace {

int compute_capability(int device) {
  int major = 0, minor = 0;
  PICTURA_CUDA(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
  PICTURA_CUDA(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
  return 10 * major + minor;
}

KernelTarget target_of(const RendererConfig& config) {
  const Rig& rig = config.rig;
  KernelTarget target{.compute_capability = compute_capability(config.device.index),
                      .num_cameras = static_cast<int>(rig.cameras.size()),
                      .randomizes_cameras = config.randomization.is_on()};
  const Camera& first = rig.cameras.front();
  for (const Camera& camera : rig.cameras) {
    if (camera.width_px != first.width_px || camera.height_px != first.height_px) return target;
  }
  target.width_px = first.width_px;
  target.height_px = first.height_px;
  return target;
}

}  // namespace

KernelLibrary::KernelLibrary(const RendererConfig& config) {
  const std::string why_not = nvrtc_unavailable();
  if (!why_not.empty()) {
    kernels_ = ahead_of_time_kernels();
    origin_ = fmt::format("kernels built ahead of time, for {} ({})", PICTURA_CUDA_ARCHITECTURES, why_not);
    const cudaError_t status = prepare_kernels(&kernels_);
    PICTURA_CHECK(status == cudaSuccess, "renderer cuda: {} do not run on a device of compute capability {}: {}",
                  origin_, compute_capability(config.device.index), cudaGetErrorString(status));
    return;
  }
  const KernelCode code = build_kernels(renderer_program(), target_of(config));
  cudaLibrary_t library = nullptr;
  PICTURA_CUDA(cudaLibraryLoadData(&library, code.bytes.data(), nullptr, nullptr, 0, nullptr, nullptr, 0));
  library_.reset(library);
  for (std::size_t i = 0; i < kKernelNames.size(); ++i) {
    cudaKernel_t handle = nullptr;
    PICTURA_CUDA(cudaLibraryGetKernel(&handle, library, kKernelNames[i]));
    kernels_.handle[i] = reinterpret_cast<const void*>(handle);
  }
  PICTURA_CUDA(prepare_kernels(&kernels_));
  origin_ = fmt::format("kernels {} for {} and this rig", code.cached ? "built earlier" : "built", code.architecture);
}

}  // namespace pictura::cuda
