// Preparation of drawing on the host: kernel arguments, and map pieces sorted for culling.
#pragma once

#include <string>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/grid.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

/// Pieces of one kind, sorted by the grid cells of their centres.
class SortedPieces {
 public:
  explicit SortedPieces(const std::vector<Strip>& strips);
  explicit SortedPieces(const std::vector<WallFace>& walls);
  /// Returns a view into this object.
  PieceGrid view() const { return {grid_.view(), balls_, largest_radius_m_}; }

 private:
  void sort(std::vector<Ball> balls);
  Grid grid_;
  std::vector<Ball> balls_;  // in the order of the grid's items
  float largest_radius_m_ = 0;
};

/// Makes a task without the renderer's own memory: geometries, pool, counters, fault word, and lists of images.
/// `images` may be null.
DrawTask make_draw_task(const RendererConfig& config, const std::vector<PinholeCamera>& cameras,
                        const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images);

/// Returns a block's scratch sizes in the overflow launch, for all primitives of a world. `pieces` counts light heads
/// too.
Scratch overflow_sizes(int pieces, int heads, std::size_t agents);

/// `fault` must not be `none`.
std::string message_of(const Fault& fault);

}  // namespace pictura::cuda
