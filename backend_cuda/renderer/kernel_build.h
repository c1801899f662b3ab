// Kernels compiled at run time by NVRTC, for one architecture and one rig, and cached on disk. Compilation needs no
// GPU, no driver and no toolkit except NVRTC, which is opened on first use.
#pragma once

#include <string>

#include "pictura/backend_cuda/renderer/kernel_sources.h"

namespace pictura::cuda {

/// Target of a compilation. Kernels receive it as PICTURA_RIG_CAMERAS, PICTURA_RIG_WIDTH_PX, PICTURA_RIG_HEIGHT_PX and
/// PICTURA_RANDOMIZES_CAMERAS.
struct KernelTarget {
  int compute_capability = 0;       // 10 * major + minor
  int num_cameras = 0;              // number of the rig's cameras; 0: any
  int width_px = 0, height_px = 0;  // common size of all cameras' images; 0: any
  bool randomizes_cameras = true;   // whether RendererConfig::randomization is on
};

struct KernelCode {
  std::string bytes;         // a cubin, or PTX if NVRTC is older than the architecture
  std::string architecture;  // sm_90, or compute_90 for PTX
  bool cached = false;       // whether the code was read from the cache
};

/// Returns an empty text if NVRTC can be opened, else the reason. $PICTURA_NVRTC is the path of the library to open, or
/// `off`.
std::string nvrtc_unavailable();

/// Compiles a program. If an earlier call had the same sources, target and version of NVRTC, reads its cached code
/// instead, unless the cached file is damaged. Throws Error if NVRTC cannot be opened, or, with the compiler's
/// messages, if compilation fails.
KernelCode build_kernels(const KernelProgram& program, const KernelTarget& target);

/// Returns the file in which build_kernels() caches the code. Empty if caching is off.
std::string kernel_cache_path(const KernelProgram& program, const KernelTarget& target);

}  // namespace pictura::cuda
