// What the kernels are told, from what a renderer is asked for: what does not depend on where memory lies.
#pragma once

#include <string>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/grid.h"
#include "pictura/common/renderer.h"

namespace pictura::cuda {

/// Pieces of one kind by the cell of their middle, in host memory.
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

/// Everything of a task but what lies in the renderer's own memory: geometries, pool, counters, lists of images and
/// fault. images may be null.
DrawTask make_draw_task(const RendererConfig& config, const std::vector<PinholeCamera>& cameras,
                        const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images);

/// Room, for a block of the last launch, for all that a world can hold of a map with so many pieces, heads among them,
/// and so many agents.
Scratch large_sizes(int pieces, int heads, std::size_t agents);

/// What was wrong, for people. Of a fault that is one.
std::string message_of(const Fault& fault);

}  // namespace pictura::cuda
