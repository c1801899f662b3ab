// Embedded sources of the kernels that are compiled at run time. cmake/EmbedSources.cmake generates their definitions.
#pragma once

#include <array>

#include "pictura/common/span.h"

namespace pictura::cuda {

struct KernelSource {
  const char* name;  // the path in #include: pictura/FOLDER/FILE
  const char* text;
};

struct KernelProgram {
  const char* text;
  Span<const KernelSource> headers;  // all headers that it includes, directly or indirectly
};

KernelProgram renderer_program();

/// Kernels in the order of their launches.
enum Kernel { kCull, kSetupFaces, kClip, kDraw, kDrawDeferred, kDrawOverflow, kVisibility, kNumKernels };
constexpr std::array<const char*, kNumKernels> kKernelNames{
    "pictura_cull",          "pictura_setup_faces",   "pictura_clip",      "pictura_draw",
    "pictura_draw_deferred", "pictura_draw_overflow", "pictura_visibility"};

}  // namespace pictura::cuda
