// Sizes and owners of the renderer's scratch memory. Buffer is DeviceBuffer, or std::vector if kernels are emulated.
#pragma once

#include "pictura/backend_cuda/renderer/kernel_arguments.h"

namespace pictura::cuda {

/// Capacity of the pool per image: the average need in CARLA's Town03, whose images have the most faces. Each face has
/// four edges; the other edges are for clipped faces.
constexpr std::size_t kPoolFaces = 320, kPoolEdges = 1488;
/// Additional capacity, in images, for small batches with many faces per image.
constexpr std::size_t kMinPoolImages = 4 * kMaxEntries / kPoolFaces + 1;
static_assert(kMinPoolImages * kPoolFaces >= kMaxEntries, "a deferred image fits into the pool");

struct PoolSizes {
  std::size_t images, faces, edges;
  /// Enough for all faces; the last batch of each image may be partly filled.
  constexpr std::size_t batches() const { return faces / FaceBatch::kEntries + images; }
  constexpr std::size_t entries() const { return images * kMaxEntries; }
  constexpr std::size_t listed_images() const { return (2 + kNumCostBuckets) * images; }
  constexpr std::size_t bytes() const {
    return faces * (sizeof(ScreenFace) + sizeof(ClippedPrimitive)) + edges * sizeof(PolygonEdge) +
           images * (sizeof(PreparedImage) + sizeof(FaceSetupContext)) + batches() * sizeof(FaceBatch) +
           entries() * sizeof(uint32_t) + listed_images() * sizeof(int32_t);
  }
};
constexpr PoolSizes pool_sizes(std::size_t images) {
  const std::size_t num_allocations = images + kMinPoolImages;
  return {images, num_allocations * kPoolFaces, num_allocations * kPoolEdges};
}
/// A pool of n images needs at most n * kPoolImageBytes + kMinPoolBytes bytes.
constexpr std::size_t kPoolImageBytes =
    (pool_sizes(FaceBatch::kEntries).bytes() - pool_sizes(0).bytes()) / FaceBatch::kEntries;
constexpr std::size_t kMinPoolBytes = pool_sizes(0).bytes() + sizeof(FaceBatch);

/// Owner of the pool's memory (see FacePool).
template <template <typename> class Buffer>
class PoolBuffers {
 public:
  PoolBuffers() = default;
  explicit PoolBuffers(const PoolSizes& sizes)
      : faces_(sizes.faces),
        edges_(sizes.edges),
        images_(sizes.images),
        contexts_(sizes.images),
        batches_(sizes.batches()),
        entries_(sizes.entries()),
        clipped_(sizes.faces),
        lists_(sizes.listed_images()) {}
  /// Sets a task's pointers to the pool and to the lists of images.
  void serve(DrawTask* task_out) {
    task_out->pool = {faces_.data(),
                      edges_.data(),
                      images_.data(),
                      contexts_.data(),
                      batches_.data(),
                      {entries_.data(), clipped_.data(), kMaxEntries, static_cast<int32_t>(clipped_.size())},
                      static_cast<int32_t>(faces_.size()),
                      static_cast<int32_t>(edges_.size())};
    task_out->deferred_images = lists_.data();
    task_out->overflow_images = lists_.data() + images_.size();
    task_out->drawn_images = lists_.data() + 2 * images_.size();
  }

 private:
  Buffer<ScreenFace> faces_;
  Buffer<PolygonEdge> edges_;
  Buffer<PreparedImage> images_;
  Buffer<FaceSetupContext> contexts_;
  Buffer<FaceBatch> batches_;
  Buffer<uint32_t> entries_;
  Buffer<ClippedPrimitive> clipped_;
  Buffer<int32_t> lists_;
};

/// Owner of the memory of the overflow launch's blocks.
template <template <typename> class Buffer>
class OverflowBuffers {
 public:
  OverflowBuffers() = default;
  OverflowBuffers(const Scratch& sizes, std::size_t bytes_per_block)
      : scratch_(sizes),
        faces_(count(sizes.blocks, sizes.max_faces)),
        edges_(count(sizes.blocks, sizes.max_edges)),
        bytes_(static_cast<std::size_t>(sizes.blocks) * bytes_per_block) {
    scratch_.faces = faces_.data();
    scratch_.edges = edges_.data();
    scratch_.bytes = bytes_.data();
  }
  const Scratch& view() const { return scratch_; }
  static std::size_t block_bytes(const Scratch& sizes, std::size_t bytes_per_block) {
    return count(1, sizes.max_faces) * sizeof(ScreenFace) + count(1, sizes.max_edges) * sizeof(PolygonEdge) +
           bytes_per_block;
  }

 private:
  static std::size_t count(int blocks, int each) {
    return static_cast<std::size_t>(blocks) * static_cast<std::size_t>(each);
  }
  Scratch scratch_;
  Buffer<ScreenFace> faces_;
  Buffer<PolygonEdge> edges_;
  Buffer<unsigned char> bytes_;
};

}  // namespace pictura::cuda
