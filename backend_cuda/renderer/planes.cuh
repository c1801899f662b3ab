// The optional planes: depth, class and instance of the front surface at each pixel's centre.
#pragma once

#include "pictura/backend_cuda/renderer/pixels.cuh"

namespace pictura::cuda {

// Collective over the block.
template <typename Memory>
__device__ __noinline__ void draw_planes(CameraPlanes planes, int width_px, int64_t first_pixel, int num_faces,
                                         Part part) {
  using Word = typename Memory::Word;
  const Memory memory = Memory::current();
  sync_block();
  list_rows(memory, num_faces, part);
  sync_block();
  // Linked list of the faces of each row: heads in memory.pixels, links in memory.candidates; 0 ends a list.
  const int num_rows = memory.state->num_rows;
  const bool fits = num_rows <= memory.max_rows;
  PICTURA_NO_UNROLL
  for (int i = static_cast<int>(threadIdx.x); fits && i < num_rows; i += Memory::kThreads) {
    memory.candidates[i] = atomicExch(&memory.pixels[memory.rows[i] & Memory::kNone], static_cast<Word>(i + 1));
  }
  sync_block();
  PICTURA_NO_UNROLL
  for (int p = static_cast<int>(threadIdx.x); p < part.num_pixels(); p += Memory::kThreads) {
    const int x = part.x_of(p), y = part.y_of(p);
    if (x >= part.x_end) continue;
    const Vec2 center = pixel_center(x, y);
    FrontFace front;
    auto each = [&](auto&& take) {
      auto ask = [&](const ScreenFace& face) {
        if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) return;
        if (covers_point(memory.edges + face.edge_begin, face.edge_count, center.x, center.y)) take(face);
      };
      if (fits) {
        PICTURA_NO_UNROLL
        for (Word at = memory.pixels[y - part.y_begin]; at != 0; at = memory.candidates[at - 1]) {
          ask(memory.faces[memory.rows[at - 1] >> Memory::kHalf]);
        }
      } else {
        PICTURA_NO_UNROLL
        for (int i = 0; i < num_faces; ++i) ask(memory.faces[i]);
      }
    };
    each([&](const ScreenFace& face) { front.add(face, center); });
    if (front.needs_second_pass()) each([&](const ScreenFace& face) { front.add_second_pass(face, center); });
    const ScreenFace* face = front.front(center, [](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
    const int64_t at = first_pixel + static_cast<int64_t>(y) * width_px + x;
    const float infinity = __uint_as_float(0x7F800000u);
    if (planes.depth_m) planes.depth_m[at] = face ? face_depth_m(*face, center) : infinity;
    if (planes.class_id) planes.class_id[at] = face ? face->class_id : uint8_t{0};
    if (planes.instance_id) planes.instance_id[at] = face ? instance_of(*face) : uint16_t{0};
  }
  reset_part(memory);
}

}  // namespace pictura::cuda
