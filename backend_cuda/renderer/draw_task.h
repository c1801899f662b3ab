// The kernels' arguments from those of a call, and maps sorted for culling: what does not depend on device memory.
#pragma once

#include <string>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/grid.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

/// Pieces of one kind, sorted by the grid cell of their centre, in host memory.
class SortedPieces {
 public:
  explicit SortedPieces(const std::vector<Strip>& strips);
  explicit SortedPieces(const std::vector<WallFace>& walls);
  /// Points into this object.
  PieceGrid view() const { return {grid_.view(), balls_, largest_radius_m_}; }

 private:
  void sort(std::vector<Ball> balls);
  Grid grid_;
  std::vector<Ball> balls_;  // as the grid's items
  float largest_radius_m_ = 0;
};

/// All of a task but the pointers to the renderer's own memory: geometries, pool, counters, lists of images and fault.
/// `images` may be null.
DrawTask make_draw_task(const RendererConfig& config, const std::vector<PinholeCamera>& cameras,
                        const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images);

/// Sizes of the scratch memory of a block of the last launch: for all primitives of a world with so many agents on a
/// map of so many pieces, light heads among them.
Scratch large_sizes(int pieces, int heads, std::size_t agents);

/// The text of a fault, which must not be `none`.
std::string message_of(const Fault& fault);

}  // namespace pictura::cuda
