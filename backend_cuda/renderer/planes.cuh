// The optional planes: depth, class and instance of the front surface at each pixel's centre.
#pragma once

#include "pictura/backend_cuda/renderer/pixels.cuh"

namespace pictura::cuda {

/// Planes of one image, as the target of writes.
struct PlaneWriter {
  CameraPlanes planes;
  int width_px;
  int64_t first_pixel;  // index of the view's first pixel
  /// face: front face at the pixel's centre; may be null.
  __device__ void write(int x, int y, const ScreenFace* face) const {
    const int64_t at = first_pixel + static_cast<int64_t>(y) * width_px + x;
    const float infinity = __uint_as_float(0x7F800000u);
    if (planes.depth_m) planes.depth_m[at] = face ? face_depth_m(*face, pixel_center(x, y)) : infinity;
    if (planes.class_id) planes.class_id[at] = face ? face->class_id : uint8_t{0};
    if (planes.instance_id) planes.instance_id[at] = face ? instance_of(*face) : uint16_t{0};
  }
};

// Lists the layers of all pixels: the faces that cover their centres. The word of a pixel, which must be 0, becomes the
// first layer plus 1. num_candidates counts the layers; those beyond max_layers are not stored. Collective over the
// block.
template <typename Memory>
__device__ void list_layers(const Memory& memory, const Part& part) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  WarpState* warp = &memory.state->warps[warp_index()];
  for_each_row(memory, part, [&](Word row, TileSpan span) {
    const int columns = span.end() - span.begin();
    warp_expand(warp, columns, warp_inclusive_sum(columns), [&](int, int owner, int k) {
      const SharedRow its = SharedRow::of<Memory>(owner, row, span, part);
      const int column = its.span.begin() + k, x = part.x_begin + column;
      bool covers = false;
      if (owner >= 0) {
        const ScreenFace& face = memory.faces[its.face];
        covers = covers_center(memory.edges + face.edge_begin, face.edge_count, its.span.row(), column,
                               pixel_center(x, its.y));
      }
      const int32_t layer = warp_allocate_one(&memory.state->num_candidates, covers);
      if (!covers || layer >= memory.max_layers) return;
      memory.layer_face[layer] = static_cast<Index>(its.face);
      memory.layer_next[layer] =
          static_cast<Index>(atomicExch(&memory.pixels[part.pixel(x, its.y)], static_cast<Word>(layer + 1)));
    });
  });
}

// Finds the front face at a pixel's centre; null if there is none. are_listed: whether all layers fit into memory.
// first: the pixel's first layer plus 1.
template <typename Memory>
__device__ __noinline__ const ScreenFace* find_front(int num_faces, bool are_listed, uint32_t first, int x, int y) {
  const Memory memory = Memory::current();
  const Vec2 center = pixel_center(x, y);
  auto each = [&](auto&& take) {
    PICTURA_NO_UNROLL
    for (uint32_t layer = first; are_listed && layer != 0; layer = memory.layer_next[layer - 1]) {
      take(memory.faces[memory.layer_face[layer - 1]]);
    }
    PICTURA_NO_UNROLL
    for (int i = 0; !are_listed && i < num_faces; ++i) {
      const ScreenFace& face = memory.faces[i];
      if (y < face.box.y_begin || y >= face.box.y_end) continue;
      const PolygonEdge* const edges = memory.edges + face.edge_begin;
      const RowSpan span = row_span(edges, face.edge_count, face.box, y);
      if (covers_center(edges, face.edge_count, span, x, center)) take(face);
    }
  };
  FrontFace front;
  each([&](const ScreenFace& face) { front.add(face, center); });
  if (front.needs_second_pass()) each([&](const ScreenFace& face) { front.add_second_pass(face, center); });
  return front.front(center, [](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
}

// Collective over the block.
template <typename Memory>
__device__ __noinline__ void draw_planes(PlaneWriter writer, int num_faces, Part part) {
  using Word = typename Memory::Word;
  const Memory memory = Memory::current();
  sync_block();
  list_rows(memory, num_faces, part);
  sync_block();
  const bool fit_rows = memory.state->num_rows <= memory.max_rows;
  if (fit_rows) list_layers(memory, part);
  sync_block();
  const bool are_listed = fit_rows && memory.state->num_candidates <= memory.max_layers;
  // Pixels with several layers are queued until every lane of the warp has one.
  WarpQueue queue(&memory.state->warps[warp_index()].queue);
  const int num_pixels = part.num_pixels();
  PICTURA_NO_UNROLL
  for (int begin = warp_index() * kWarpSize;; begin += Memory::kThreads) {
    const int p = begin + lane_index();
    const bool more = begin < num_pixels;
    bool is_searched = false;
    Word first = 0;
    if (p < num_pixels && part.x_of(p) < part.x_end) {
      first = memory.pixels[p];
      is_searched = !are_listed || (first != 0 && memory.layer_next[first - 1] != 0);
      if (!is_searched) {
        writer.write(part.x_of(p), part.y_of(p), first == 0 ? nullptr : memory.faces + memory.layer_face[first - 1]);
      }
    }
    queue.push(is_searched, static_cast<uint32_t>(p), static_cast<uint32_t>(first));
    if (queue.is_ready() || (!more && !queue.is_empty())) {
      const WarpQueue::Pair pair = queue.take();
      if (pair.is_valid) {
        const int pixel = static_cast<int>(pair.a), x = part.x_of(pixel), y = part.y_of(pixel);
        writer.write(x, y, find_front<Memory>(num_faces, are_listed, pair.b, x, y));
      }
    }
    if (!more && queue.is_empty()) break;
  }
  reset_part(memory);
}

}  // namespace pictura::cuda
