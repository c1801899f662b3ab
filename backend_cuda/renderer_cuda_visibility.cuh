// What an agent weighs in an image, among all others and alone (see SeenWeight).
#pragma once

#include "pictura/backend_cuda/renderer_cuda_faces.cuh"
#include "pictura/backend_cuda/renderer_cuda_pixels.cuh"
#include "pictura/backend_cuda/renderer_cuda_write.cuh"

namespace pictura::cuda {

/// Adds up what the faces of an agent weigh.
struct WeighAgent {
  static constexpr bool kWanted = true;
  uint32_t number;
  int64_t* sum;
  __device__ void operator()(const ScreenFace& face, float weight) const {
    if (face.number == number) *sum += SeenWeight::units_of(weight);
  }
};

/// Rows of an image.
struct RowRange {
  int y_begin, y_end;
};

// The rows in which a thing of the gathered image may show. Every thread finds them by itself.
__device__ inline RowRange rows_of(const BlockState& state, uint32_t number) {
  RowRange rows{state.making.setting.camera.height_px, 0};
  PICTURA_KEEP_LOOP
  for (int i = 0; i < state.num_faces; ++i) {
    const ScreenFace& face = state.faces[i];
    if (face.number != number || face.box.y_begin >= face.box.y_end) continue;
    rows.y_begin = min_of(rows.y_begin, int{face.box.y_begin});
    rows.y_end = max_of(rows.y_end, int{face.box.y_end});
  }
  return rows;
}

// Adds what a thing of the gathered image weighs, among all others and then without them, to each thread's sum of its
// own. False where there is no room for all of it. All threads of the block.
__device__ inline bool weigh(BlockState* state, uint32_t number, SeenWeight* sum_inout) {
  const RowRange rows = rows_of(*state, number);
  const int num_faces = state->num_faces;
  auto add_to = [&](int64_t* sum) {
    return each_tile(LargeDrawMemory::current(), state->making.setting.camera.width_px, rows.y_begin, rows.y_end,
                     [&](const LargeDrawMemory& memory, const Part& part) {
                       return draw_faces(memory, num_faces, part, WeighAgent{number, sum}, NoImage{});
                     });
  };
  if (!add_to(&sum_inout->among_all)) return false;
  sync_block();
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < num_faces; i += LargeDrawMemory::kThreads) {
    if (state->faces[i].number != number) state->faces[i].box = PixelBox{};
  }
  sync_block();
  return add_to(&sum_inout->alone);
}

}  // namespace pictura::cuda
