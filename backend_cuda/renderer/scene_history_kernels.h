// Kernels of scene histories. Launches are asynchronous on a stream; callers check cudaGetLastError().
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/common/history_views.h"

namespace pictura::cuda {

/// Computes first[i] = from[i] + added.
void launch_shift(Span<const int32_t> from, int32_t added, int32_t* first, cudaStream_t stream);
void launch_gather(const HistoryViews& history, Span<const int64_t> rows, View* views_out, cudaStream_t stream);

}  // namespace pictura::cuda
