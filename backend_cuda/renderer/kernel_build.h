// Kernels compiled where they run: by NVRTC, for one architecture and one rig, and kept on disk. Needs no GPU, no
// driver and no toolkit but NVRTC itself, which is opened when it is first asked for.
#pragma once

#include <string>

#include "pictura/backend_cuda/renderer/kernel_sources.h"

namespace pictura::cuda {

/// What kernels are compiled for. They see the rig as PICTURA_RIG_CAMERAS, PICTURA_RIG_WIDTH_PX, PICTURA_RIG_HEIGHT_PX.
struct KernelTarget {
  int compute_capability = 0;       // 10 * major + minor
  int num_cameras = 0;              // of the rig; 0: any
  int width_px = 0, height_px = 0;  // of all cameras, where they have one size; 0: any
};

struct KernelCode {
  std::string bytes;         // a cubin, or PTX where NVRTC is older than the architecture
  std::string architecture;  // sm_90, or compute_90 for PTX
  bool cached = false;       // read from disk
};

/// Empty where NVRTC can be opened, else why not. $PICTURA_NVRTC names the library to open, or is `off`.
std::string nvrtc_unavailable();

/// Compiles a program, or reads what an earlier call compiled from the same sources and for the same target by the same
/// version of NVRTC, unless that file is damaged. Throws Error with the compiler's messages, or where NVRTC cannot be
/// opened.
KernelCode build_kernels(const KernelProgram& program, const KernelTarget& target);

/// The file in which build_kernels() keeps the code. Empty when nothing is kept.
std::string kernel_cache_path(const KernelProgram& program, const KernelTarget& target);

}  // namespace pictura::cuda
