// How a batch is cut into the chunks that go through the network one after the other. All chunks of a batch have one
// size, and on a device few sizes come at all: what libraries choose and build for a size (cuDNN's plans, CUDA graphs)
// is then made once, however many agents are active.
#pragma once

#include <algorithm>

#include <ATen/ATen.h>

namespace pictura {

/// On a device sizes of chunks are multiples of this, where the largest that is allowed is larger.
constexpr int64_t kChunkGranule = 256;

/// How large the chunks of a batch are: equal parts of it of at most `most`; or all `most`, so that arithmetic that
/// depends on a chunk's size does not depend on the batch's.
struct ChunkSizes {
  int64_t most = 1;
  bool are_full = false;
};

/// Of each chunk of a batch of `count`.
inline int64_t chunk_size(int64_t count, const ChunkSizes& sizes, bool on_device) {
  const int64_t most = sizes.most;
  if (sizes.are_full) return most;
  const int64_t chunks = (count + most - 1) / most, granule = on_device ? kChunkGranule : 1;
  const int64_t equal = (count + chunks - 1) / chunks;
  return std::min(most, (equal + granule - 1) / granule * granule);
}

/// Some rows of a batch, which begin there at `begin`. Of `rows`, i64 [size of chunks], those past the first `count`
/// fill it up: they repeat the batch's first row, and what is computed for them must not count.
struct Chunk {
  at::Tensor rows;
  int64_t begin = 0, count = 0;

  int64_t size() const { return rows.size(0); }
  /// Numbers of the batch, those of the chunk followed by zeros.
  at::Tensor take(const at::Tensor& of_batch) const {
    return at::constant_pad_nd(of_batch.narrow(0, begin, count), {0, size() - count});
  }
};

/// Calls f(const Chunk&) for all chunks of a batch of rows, i64 [n].
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
