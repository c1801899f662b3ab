// Splits a batch into chunks of equal size for the network. On a device, only a few different sizes occur. So cuDNN's
// plans and CUDA graphs are rarely rebuilt when the number of active agents changes.
#pragma once

#include <algorithm>

#include <ATen/ATen.h>

namespace pictura {

/// Chunk sizes on a device are multiples of this number, or the maximum size.
constexpr int64_t kChunkGranule = 256;

/// Chunks of at most `max_size` rows. `are_full`: exactly `max_size` rows, so that results do not depend on the batch
/// size.
struct ChunkSizes {
  int64_t max_size = 1;
  bool are_full = false;
};

/// Returns the chunk size for `count` rows.
inline int64_t chunk_size(int64_t count, const ChunkSizes& sizes, bool on_device) {
  const int64_t max_size = sizes.max_size;
  if (sizes.are_full) return max_size;
  const int64_t chunks = (count + max_size - 1) / max_size, granule = on_device ? kChunkGranule : 1;
  const int64_t equal = (count + chunks - 1) / chunks;
  return std::min(max_size, (equal + granule - 1) / granule * granule);
}

/// Elements [begin, begin + count) of a batch. rows: i64 [chunk size], row numbers, then padding. Padding repeats the
/// batch's first element; its results must be discarded.
struct Chunk {
  at::Tensor rows;
  int64_t begin = 0, count = 0;

  int64_t size() const { return rows.size(0); }
  /// Returns the chunk's elements of an array, padded with zeros.
  at::Tensor take(const at::Tensor& of_batch) const {
    return at::constant_pad_nd(of_batch.narrow(0, begin, count), {0, size() - count});
  }
};

/// Calls f(const Chunk&) for all chunks of `batch`, row numbers i64 [n].
template <typename F>
void for_each_chunk(const at::Tensor& batch, const ChunkSizes& sizes, const F& f) {
  const int64_t total = batch.size(0);
  if (total == 0) return;
  const int64_t size = chunk_size(total, sizes, !batch.is_cpu());
  for (int64_t begin = 0; begin < total; begin += size) {
    const int64_t count = std::min(size, total - begin);
    const at::Tensor rows = batch.narrow(0, begin, count);
    f(Chunk{count == size ? rows : at::cat({rows, batch.narrow(0, 0, 1).expand({size - count})}), begin, count});
  }
}

}  // namespace pictura
