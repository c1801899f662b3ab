// Preparation of drawing on the host: converts a call's arguments to the kernels' arguments, and sorts the pieces of
// maps for culling.
#pragma once

#include <string>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/grid.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

/// Pieces of one kind, sorted by the grid cells of their centres, in host memory.
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

/// Makes a task except for the pointers to the renderer's own memory: geometries, pool, counters, lists of images and
/// fault. `images` may be null.
DrawTask make_draw_task(const RendererConfig& config, const std::vector<PinholeCamera>& cameras,
                        const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images);

/// Returns the sizes of a block's scratch memory in the overflow launch (the last one). They suffice for all primitives
/// of a world with `agents` agents on a map with `pieces` pieces, of which `heads` are light heads.
Scratch overflow_sizes(int pieces, int heads, std::size_t agents);

/// Returns the text of a fault, which must not be `none`.
std::string message_of(const Fault& fault);

}  // namespace pictura::cuda
