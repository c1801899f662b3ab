// The renderer's kernels on a device: built for its rig by NVRTC, or built ahead of time.
#pragma once

#include <memory>
#include <string>
#include <type_traits>

#include "pictura/backend_cuda/renderer/launch.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

/// Owner of the loaded code of kernels.
class KernelLibrary {
 public:
  /// Builds the kernels for a configuration's rig and CUDA device, which must be the current device. Without NVRTC,
  /// uses the kernels that are compiled into this program, and throws Error if they do not run on the device.
  explicit KernelLibrary(const RendererConfig& config);

  const KernelSet& kernels() const { return kernels_; }
  /// Origin of the kernels, for messages.
  const std::string& origin() const { return origin_; }

 private:
  struct Unload {
    void operator()(cudaLibrary_t library) const { cudaLibraryUnload(library); }
  };
  std::unique_ptr<std::remove_pointer_t<cudaLibrary_t>, Unload> library_;
  KernelSet kernels_;
  std::string origin_;
};

}  // namespace pictura::cuda
