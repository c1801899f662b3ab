// The texts that kernels are compiled from at run time: part of the library, so that an installed copy needs no source
// tree. cmake/EmbedSources.cmake writes their definitions.
#pragma once

#include "pictura/common/span.h"

namespace pictura::cuda {

struct KernelSource {
  const char* name;  // as it is included: pictura/FOLDER/FILE
  const char* text;
};

struct KernelProgram {
  const char* text;
  Span<const KernelSource> headers;  // what it includes, directly or not
};

/// The renderer's kernels.
KernelProgram renderer_program();

}  // namespace pictura::cuda
