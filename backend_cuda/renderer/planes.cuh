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

/// Word of a pixel whose front face must be searched. Other pixels have 0, or 1 plus the index of the only face that
/// touches them, and covers them fully.
template <typename Memory>
constexpr typename Memory::Word kSearchedPixel = ~typename Memory::Word{0};

// Lists each row's faces, and sets the words of all pixels, which must be 0. Collective over the block.
template <typename Memory>
__device__ void link_rows(const Memory& memory, const Part& part) {
  using Word = typename Memory::Word;
  WarpState* warp = &memory.state->warps[warp_index()];
  for_each_row(memory, part, [&](int at, Word row, TileSpan span) {
    const int count = span.end() - span.begin();
    if (count > 0) {
      memory.spans[at] = span.bytes;
      memory.links[at] = atomicExch(&memory.first_rows[row & Memory::kNone], static_cast<Word>(at + 1));
    }
    warp_expand(warp, count, warp_inclusive_sum(count), [&](int, int owner, int k) {
      const SharedRow its = SharedRow::of<Memory>(owner, row, span, part);
      if (owner < 0) return;
      const int column = its.span.begin() + k;
      const bool is_full = its.span.row().is_full(column);
      Word* const pixel = &memory.pixels[part.pixel(part.x_begin + column, its.y)];
      // If several faces touch a pixel, all threads but the first find a word, and mark the pixel after their exchange.
      // So the word of a face remains only where no other face touches the pixel.
      const Word before = atomicExch(pixel, is_full ? static_cast<Word>(its.face + 1) : kSearchedPixel<Memory>);
      if (before != 0) atomicOr(pixel, kSearchedPixel<Memory>);
    });
  });
}

// Finds the front face at a pixel's centre; null if there is none. are_linked: whether all rows of faces fit into
// memory.
template <typename Memory>
__device__ __noinline__ const ScreenFace* find_front(int num_faces, bool are_linked, int x, int y, Part part) {
  using Word = typename Memory::Word;
  const Memory memory = Memory::current();
  const Vec2 center = pixel_center(x, y);
  auto each = [&](auto&& take) {
    auto ask = [&](const ScreenFace& face, const RowSpan& span, int column) {
      if (covers_center(memory.edges + face.edge_begin, face.edge_count, span, column, center)) take(face);
    };
    if (are_linked) {
      PICTURA_NO_UNROLL
      for (Word at = memory.first_rows[y - part.y_begin]; at != 0; at = memory.links[at - 1]) {
        ask(memory.faces[memory.rows[at - 1] >> Memory::kHalf], TileSpan(memory.spans[at - 1]).row(), x - part.x_begin);
      }
      return;
    }
    PICTURA_NO_UNROLL
    for (int i = 0; i < num_faces; ++i) {
      const ScreenFace& face = memory.faces[i];
      if (y < face.box.y_begin || y >= face.box.y_end) continue;
      ask(face, row_span(memory.edges + face.edge_begin, face.edge_count, face.box, y), x);
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
  for (int i = static_cast<int>(threadIdx.x); i < part.num_rows(); i += Memory::kThreads) memory.first_rows[i] = 0;
  sync_block();
  const bool are_linked = memory.state->num_rows <= memory.max_rows;
  if (are_linked) link_rows(memory, part);
  sync_block();
  // Pixels that must be searched are queued until every lane of the warp has one.
  WarpQueue queue(&memory.state->warps[warp_index()].queue);
  const int num_pixels = part.num_pixels();
  PICTURA_NO_UNROLL
  for (int first = warp_index() * kWarpSize;; first += Memory::kThreads) {
    const int p = first + lane_index();
    const bool more = first < num_pixels;
    bool is_searched = false;
    if (p < num_pixels && part.x_of(p) < part.x_end) {
      const Word word = are_linked ? memory.pixels[p] : kSearchedPixel<Memory>;
      is_searched = word == kSearchedPixel<Memory>;
      if (!is_searched) writer.write(part.x_of(p), part.y_of(p), word == 0 ? nullptr : memory.faces + (word - 1));
    }
    queue.push(is_searched, static_cast<uint32_t>(p), 0);
    if (queue.is_ready() || (!more && !queue.is_empty())) {
      const WarpQueue::Pair pair = queue.take();
      if (pair.is_valid) {
        const int x = part.x_of(static_cast<int>(pair.a)), y = part.y_of(static_cast<int>(pair.a));
        writer.write(x, y, find_front<Memory>(num_faces, are_linked, x, y, part));
      }
    }
    if (!more && queue.is_empty()) break;
  }
  reset_part(memory);
}

}  // namespace pictura::cuda
