#include "pictura/backend_cuda/renderer/scene_history_kernels.h"

namespace pictura::cuda {

namespace {

constexpr int kThreads = 256;
unsigned blocks_for(size_t count) { return static_cast<unsigned>((count + kThreads - 1) / kThreads); }

__global__ void shift(Span<const int32_t> from, int32_t added, int32_t* first) {
  const size_t i = blockIdx.x * size_t{blockDim.x} + threadIdx.x;
  if (i < from.size()) first[i] = from[i] + added;
}

__global__ void gather(HistoryViews history, Span<const int64_t> rows, View* views_out) {
  const size_t i = blockIdx.x * size_t{blockDim.x} + threadIdx.x;
  if (i < rows.size()) views_out[i] = history.at(rows[i]);
}

}  // namespace

void launch_shift(Span<const int32_t> from, int32_t added, int32_t* first, cudaStream_t stream) {
  shift<<<blocks_for(from.size()), kThreads, 0, stream>>>(from, added, first);
}

void launch_gather(const HistoryViews& history, Span<const int64_t> rows, View* views_out, cudaStream_t stream) {
  gather<<<blocks_for(rows.size()), kThreads, 0, stream>>>(history, rows, views_out);
}

}  // namespace pictura::cuda
