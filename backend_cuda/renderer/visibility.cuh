// Visible weight of an agent in an image (see VisibilitySum).
#pragma once

#include "pictura/backend_cuda/renderer/face_setup.cuh"
#include "pictura/backend_cuda/renderer/image_writer.cuh"
#include "pictura/backend_cuda/renderer/pixels.cuh"

namespace pictura::cuda {

struct AccumulateVisibility {
  static constexpr bool kWanted = true;
  uint32_t object_id;
  int64_t* sum;
  __device__ void operator()(const ScreenFace& face, float weight) const {
    if (face.object_id == object_id) *sum += VisibilitySum::units_of(weight);
  }
};

struct RowRange {
  int y_begin, y_end;
};

// Returns the rows of the prepared image that an object may touch.
__device__ inline RowRange rows_of(const BlockState& state, uint32_t object_id) {
  RowRange rows{state.context.setting.camera.height_px, 0};
  PICTURA_NO_UNROLL
  for (int i = 0; i < state.num_faces; ++i) {
    const ScreenFace& face = state.faces[i];
    if (face.object_id != object_id || face.box.y_begin >= face.box.y_end) continue;
    rows.y_begin = min_of(rows.y_begin, int{face.box.y_begin});
    rows.y_end = max_of(rows.y_end, int{face.box.y_end});
  }
  return rows;
}

// Adds an object's weights in the prepared image to the thread's sums: first drawn among all objects, then drawn alone.
// Returns false if the image does not fit into memory. Collective over the block.
__device__ inline bool accumulate_visibility(BlockState* state, uint32_t object_id, VisibilitySum* sum_inout) {
  const RowRange rows = rows_of(*state, object_id);
  const int num_faces = state->num_faces;
  auto add_to = [&](int64_t* sum) {
    return for_each_tile(LargeDrawMemory::current(), state->context.setting.camera.width_px, rows.y_begin, rows.y_end,
                         [&](const LargeDrawMemory& memory, const Part& part) {
                           return draw_faces(memory, num_faces, part, AccumulateVisibility{object_id, sum}, NoImage{});
                         });
  };
  if (!add_to(&sum_inout->among_all)) return false;
  sync_block();
  PICTURA_NO_UNROLL
  for (int i = static_cast<int>(threadIdx.x); i < num_faces; i += LargeDrawMemory::kThreads) {
    if (state->faces[i].object_id != object_id) state->faces[i].box = PixelBox{};
  }
  sync_block();
  return add_to(&sum_inout->alone);
}

}  // namespace pictura::cuda
