// Kernels compiled at run time, for one architecture and one rig, and cached on disk. Compilation needs only NVRTC,
// which is opened on first use.
#pragma once

#include <string>

#include "pictura/backend_cuda/renderer/kernel_sources.h"

namespace pictura::cuda {

/// Target of a compilation. Kernels receive it as the macros of rig.cuh.
struct KernelTarget {
  int compute_capability = 0;       // 10 * major + minor
  int num_cameras = 0;              // 0: any
  int width_px = 0, height_px = 0;  // size of all cameras' images; 0: any
  bool randomizes_cameras = true;
};

struct KernelCode {
  std::string bytes;         // a cubin, or PTX if NVRTC is older than the architecture
  std::string architecture;  // sm_90, or compute_90 for PTX
  bool cached = false;
};

/// Returns why NVRTC cannot be opened; empty if it can. $PICTURA_NVRTC is the library's path, or `off`.
std::string nvrtc_unavailable();

/// Compiles a program, or reads the cached code of the same sources, target and NVRTC version. Throws Error if NVRTC
/// cannot be opened, or, with the compiler's messages, if compilation fails.
KernelCode build_kernels(const KernelProgram& program, const KernelTarget& target);

/// Returns the cache file of build_kernels(); empty if caching is off.
std::string kernel_cache_path(const KernelProgram& program, const KernelTarget& target);

}  // namespace pictura::cuda
