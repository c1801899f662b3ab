// The renderer's kernels on a device, built at run time or ahead of time.
#pragma once

#include <memory>
#include <string>
#include <type_traits>

#include "pictura/backend_cuda/renderer/launch.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

class KernelLibrary {
 public:
  /// Builds the kernels for the configuration's rig and device, which must be current. Without NVRTC, uses the
  /// program's own kernels. Throws Error if they do not run on the device.
  explicit KernelLibrary(const RendererConfig& config);

  const KernelSet& kernels() const { return kernels_; }
  /// Describes how and when the kernels were built, for messages.
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
