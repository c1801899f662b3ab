// The renderer's scratch memory (all except images, scenes and maps): sizes and owners. Buffer is DeviceBuffer, or
// std::vector if kernels are emulated.
#pragma once

#include "pictura/backend_cuda/renderer/kernel_arguments.h"

namespace pictura::cuda {

/// Capacity of the pool per image, in faces and edges: the average need in CARLA's towns. Images that do not fit are
/// drawn when the pool is free again. Four edges belong to each face. The other edges are for clipped faces; about a
/// third of these edges is used.
constexpr std::size_t kPoolFaces = 200, kPoolEdges = 928;
/// Additional capacity in images, for batches of few images that may all have many faces.
constexpr std::size_t kMinPoolImages = 4 * kMaxEntries / kPoolFaces + 1;
static_assert(kMinPoolImages * kPoolFaces >= kMaxEntries, "a deferred image fits into the pool");

/// Capacities of a pool.
struct PoolSizes {
  std::size_t images, faces, edges;
  /// Returns enough batches for all faces; the last batch of each image may be partly filled.
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
/// Bytes of a pool per image, and bytes of a pool without images. For a pool of n images, n * kPoolImageBytes +
/// kMinPoolBytes bytes are enough. The pool's real size is smaller by at most one FaceBatch.
constexpr std::size_t kPoolImageBytes =
    (pool_sizes(FaceBatch::kEntries).bytes() - pool_sizes(0).bytes()) / FaceBatch::kEntries;
constexpr std::size_t kMinPoolBytes = pool_sizes(0).bytes() + sizeof(FaceBatch);

/// Owner of the pool: the faces of many images and the intermediate results of their set-up.
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

/// Owner of the memory of the blocks of the last launch.
template <template <typename> class Buffer>
class OverflowBuffers {
 public:
  OverflowBuffers() = default;
  /// Allocates for sizes.blocks blocks.
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
