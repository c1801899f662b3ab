// From the faces of an image to fragments: what a face covers of a pixel. Rows of faces find, for each pixel, the
// nearest face that covers it fully, behind which nothing can be seen, and list the pixels that faces cover partly;
// those that may show become fragments, one thread for each, and one for each edge that cuts a pixel.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_memory.cuh"
#include "pictura/backend_cuda/renderer_cuda_rig.cuh"

namespace pictura::cuda {

__device__ inline int image_width() {
  return PICTURA_RIG_WIDTH_PX > 0 ? PICTURA_RIG_WIDTH_PX : block_state()->shown.width_px;
}

/// Rows [y_begin, y_end) of an image, or columns [x_begin, x_end) of one row. Pixels count from the first row's first.
struct Part {
  int y_begin, y_end, x_begin, x_end;
  __device__ int num_pixels() const { return (y_end - y_begin) * image_width(); }
  __device__ int pixel(int x, int y) const { return (y - y_begin) * image_width() + x; }
  __device__ int x_of(int pixel) const { return pixel % image_width(); }
  __device__ int y_of(int pixel) const { return y_begin + pixel / image_width(); }
};

// A pixel's word while the nearest full faces are found: the larger is the nearer; 0 for none. The bits of a nearness
// sort like the nearness; those that have no room are left off.
template <typename Word>
constexpr int kFaceBits = sizeof(Word) == 4 ? kMarkedFaceBits : 32;

template <typename Word>
__device__ Word full_mark(float nearness, int face) {
  return static_cast<Word>(__float_as_uint(nearness) >> (sizeof(Word) == 4 ? kMarkedFaceBits : 0)) << kFaceBits<Word> |
         static_cast<Word>(face + 1);
}
template <typename Word>
__device__ int marked_face(Word mark) {
  return static_cast<int>(mark & ((Word{1} << kFaceBits<Word>)-1)) - 1;
}

// The face that covers a pixel fully and hides what is behind it; kNone where there is none, or where it stands among
// the pixel's fragments.
template <typename Memory>
__device__ typename Memory::Word full_of(const Memory& memory, int pixel) {
  return memory.pixels[pixel] >> Memory::kHalf;
}

// Lists the rows that faces have in a part. Those that find no room are counted. All threads of the block.
template <typename Memory>
__device__ void list_rows(const Memory& memory, int num_faces, const Part& part) {
  using Word = typename Memory::Word;
  WarpState* warp = &memory.state->warps[warp_index()];
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < num_faces; first += num_threads()) {
    const int face = first + lane_index();
    int y_begin = 0, rows = 0;
    if (face < num_faces) {
      const PixelBox box = memory.faces[face].box;
      y_begin = max_of(box.y_begin, part.y_begin);
      const bool is_beside = box.x_begin >= part.x_end || box.x_end <= part.x_begin;
      rows = is_beside ? 0 : max_of(0, min_of(box.y_end, part.y_end) - y_begin);
    }
    const int row = y_begin - part.y_begin;
    const int32_t place = take_places(&memory.state->num_rows, rows);
    share_out(warp, rows, [&](int owner, int k) {
      const int from = max_of(owner, 0);
      const int at = __shfl_sync(kAllLanes, place, from) + k, its_row = __shfl_sync(kAllLanes, row, from) + k;
      if (owner >= 0 && at < memory.max_rows) {
        memory.rows[at] = static_cast<Word>(first + owner) << Memory::kHalf | static_cast<Word>(its_row);
      }
    });
  }
}

// Lists what may become a fragment, where there is room.
template <typename Memory>
__device__ void list_candidate(const Memory& memory, int place, int face, int pixel, bool covers_fully) {
  using Word = typename Memory::Word;
  if (place >= memory.max_candidates) return;
  memory.candidates[place] = static_cast<Word>(face) << Memory::kHalf | static_cast<Word>(pixel) |
                             (covers_fully ? Memory::kCoversFully : Word{0});
}

// Marks a pixel that a face covers fully, unless a nearer one has. Returns the face that gives way to the other, and
// may still show before it; -1: none does.
template <typename Memory>
__device__ int mark_pixel(const Memory& memory, int face, int x, int y, int pixel) {
  using Word = typename Memory::Word;
  const Word mark = full_mark<Word>(middle_nearness(memory.faces[face], x, y), face);
  Word had = memory.pixels[pixel];
  if (had < mark) had = atomicMax(&memory.pixels[pixel], mark);
  const int other = marked_face(had);
  if (other < 0) return -1;
  const int loser = had < mark ? other : face, winner = had < mark ? face : other;
  return may_show_before(memory.faces[loser], memory.faces[winner], x, y, true) ? loser : -1;
}

// Marks, in a part, the nearest face that covers each pixel fully, and lists the pixels that faces cover partly. Rows
// of a large face stand side by side, so they are dealt out. All threads of the block.
template <typename Memory>
__device__ void mark_and_list(const Memory& memory, const Part& part) {
  BlockState* state = memory.state;
  WarpState* warp = &state->warps[warp_index()];
  const int num_rows = state->num_rows, deals = deals_of(num_rows);
  PICTURA_KEEP_LOOP
  for (;;) {
    const int deal = next_of(&state->next_batch);
    if (deal >= deals) return;
    const int at = lane_index() * deals + deal;
    int face = 0, y = 0;
    RowSpan span;
    if (at < num_rows) {
      const auto row = memory.rows[at];
      face = static_cast<int>(row >> Memory::kHalf);
      y = part.y_begin + static_cast<int>(row & Memory::kNone);
      const ScreenFace& its = memory.faces[face];
      span = row_span(memory.edges + its.edge_begin, its.edge_count, its.box, y);
      auto within = [&](int32_t x) { return min_of(max_of(x, part.x_begin), part.x_end); };
      span = {within(span.begin), within(span.end), within(span.full_begin), within(span.full_end)};
    }
    const int full = span.full_end - span.full_begin, lead = span.full_begin - span.begin;
    auto of = [](int value, int lane) { return __shfl_sync(kAllLanes, value, max_of(lane, 0)); };
    share_out(warp, full, [&](int owner, int k) {
      const int its_face = of(face, owner), its_y = of(y, owner), x = of(span.full_begin, owner) + k;
      const int pixel = part.pixel(x, its_y);
      const int loser = owner >= 0 ? mark_pixel(memory, its_face, x, its_y, pixel) : -1;
      if (!__any_sync(kAllLanes, loser >= 0)) return;
      const int32_t place = take_place(&state->num_candidates, loser >= 0);
      if (loser >= 0) list_candidate(memory, place, loser, pixel, true);
    });
    const int partial = span.end - span.begin - full;
    const int32_t first_place = take_places(&state->num_candidates, partial);
    share_out(warp, partial, [&](int owner, int k) {
      const int its_face = of(face, owner), its_y = of(y, owner), its_lead = of(lead, owner);
      const int begin = of(span.begin, owner), full_end = of(span.full_end, owner);
      const int x = k < its_lead ? begin + k : full_end + (k - its_lead);
      const int place = of(first_place, owner) + k;
      if (owner >= 0) list_candidate(memory, place, its_face, part.pixel(x, its_y), false);
    });
  }
}

// Turns the marks of a part into what pixels hold from then on: in the upper half the full face (kNone: none), in the
// lower half the number of fragments.
template <typename Memory>
__device__ void start_counts(const Memory& memory, const Part& part) {
  using Word = typename Memory::Word;
  const int count = part.num_pixels();
  if (threadIdx.x == 0) memory.state->next_batch = 0;
  PICTURA_KEEP_LOOP
  for (int p = static_cast<int>(threadIdx.x); p < count; p += num_threads()) {
    const int face = marked_face(memory.pixels[p]);
    memory.pixels[p] = (face < 0 ? Memory::kNone : static_cast<Word>(face)) << Memory::kHalf;
  }
}

// Lets edges cut fragments: a fragment and an edge that crosses its pixel for each lane.
template <typename Memory>
__device__ void cut_fragments(const Memory& memory, WarpQueue::Pair cut, const Part& part) {
  if (!cut.is_one) return;
  const PolygonEdge edge = memory.edges[cut.b];
  const int pixel = memory.pixel[cut.a], x = part.x_of(pixel), y = part.y_of(pixel);
  const uint64_t samples = samples_cut(edge, x, y);
  const int32_t area_units = area_cut(edge, x, y);
  atomicAnd(&memory.samples_low[cut.a], static_cast<uint32_t>(samples));
  atomicAnd(&memory.samples_high[cut.a], static_cast<uint32_t>(samples >> 32));
  if (area_units != 0) atomicAdd(&memory.area_units[cut.a], area_units);
}

// Makes a fragment for each lane's candidate, and puts aside the edges that cut it; leaves none aside if is_last.
template <typename Memory>
__device__ void start_fragments(const Memory& memory, WarpQueue::Pair candidate, const Part& part, WarpQueue* cuts,
                                bool is_last) {
  const int32_t fragment = take_place(&memory.state->num_fragments, candidate.is_one);
  const bool has_room = candidate.is_one && fragment < memory.max_fragments;
  const int pixel = static_cast<int>(candidate.b & ~static_cast<uint32_t>(Memory::kCoversFully));
  const int x = part.x_of(pixel), y = part.y_of(pixel);
  int edge_begin = 0, edge_count = 0;
  int32_t area_units = static_cast<int32_t>(kAreaUnits);
  if (has_room && (candidate.b & Memory::kCoversFully) == 0) {
    const ScreenFace& face = memory.faces[candidate.a];
    edge_begin = face.edge_begin;
    edge_count = face.edge_count;
    area_units = 0;
  }
  uint32_t crossing = 0;
  PICTURA_KEEP_LOOP
  for (int e = 0; e < edge_count; ++e) {
    const PolygonEdge edge = memory.edges[edge_begin + e];
    const PixelSide side = side_of(edge, x, y);
    if (side == PixelSide::outside) {
      area_units = crossing = 0;
      break;
    }
    if (side == PixelSide::crossed) {
      crossing |= 1u << e;
    } else {
      area_units += area_beside(edge, y);
    }
  }
  if (has_room) {
    memory.samples_low[fragment] = memory.samples_high[fragment] = ~0u;
    memory.area_units[fragment] = area_units;
    memory.face[fragment] = static_cast<typename Memory::Index>(candidate.a);
    memory.pixel[fragment] = static_cast<typename Memory::Index>(pixel);
  }
  __syncwarp();
  PICTURA_KEEP_LOOP
  for (;;) {
    cuts->push(crossing != 0, static_cast<uint32_t>(fragment),
               static_cast<uint32_t>(edge_begin + __ffs(static_cast<int>(crossing)) - 1));
    crossing &= crossing - 1;
    const bool more = __any_sync(kAllLanes, crossing != 0);
    PICTURA_KEEP_LOOP
    while (cuts->is_ready() || (is_last && !more && !cuts->is_empty())) cut_fragments(memory, cuts->take(), part);
    if (!more) return;
  }
}

// Makes fragments of those candidates that may show before what covers their pixel fully. Threads put them aside until
// every lane of a warp has one. All threads of the block.
template <typename Memory>
__device__ void make_fragments(const Memory& memory, const Part& part) {
  WarpState* warp = &memory.state->warps[warp_index()];
  WarpQueue shown(&warp->pixels), cuts(&warp->cuts);
  const int count = memory.state->num_candidates;
  PICTURA_KEEP_LOOP
  for (;;) {
    const int i = next_of(&memory.state->next_batch) * kWarpSize + lane_index();
    const bool more = i - lane_index() < count;
    bool shows = false;
    uint32_t face = 0, place = 0;
    if (i < count) {
      const auto candidate = memory.candidates[i];
      face = static_cast<uint32_t>(candidate >> Memory::kHalf);
      place = static_cast<uint32_t>(candidate & Memory::kNone);
      const bool covers_fully = (place & Memory::kCoversFully) != 0;
      const int pixel = static_cast<int>(place & ~static_cast<uint32_t>(Memory::kCoversFully));
      const auto full = full_of(memory, pixel);
      shows = full == Memory::kNone ||
              may_show_before(memory.faces[face], memory.faces[full], part.x_of(pixel), part.y_of(pixel), covers_fully);
    }
    shown.push(shows, face, place);
    if (shown.is_ready() || !more) start_fragments(memory, shown.take(), part, &cuts, !more);
    if (!more) return;
  }
}

template <typename Memory>
__device__ void keep_fragment(const Memory& memory, int fragment, int pixel, const PixelCoverage& coverage) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  const uint64_t reach = reach_of(coverage);
  memory.area[fragment] = coverage.area;
  memory.free_low[fragment] = static_cast<uint32_t>(reach);
  memory.free_high[fragment] = static_cast<uint32_t>(reach >> 32);
  memory.rank[fragment] = static_cast<Index>(atomicAdd(&memory.pixels[pixel], Word{1}) & Memory::kNone);
}

// Finishes fragments when all edges have cut them: those that are left get a rank among the fragments of their pixel.
// Where one covers its pixel, it may intersect the pixel's full face, which then becomes a fragment too.
template <typename Memory>
__device__ void finish_fragments(const Memory& memory, int count) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  constexpr Word kUpperHalf = ~Memory::kNone;
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < count; i += num_threads()) {
    const PixelCoverage coverage = rounded_coverage(memory.area_units[i], memory.samples(i));
    const int pixel = memory.pixel[i];
    if (coverage.area <= 0.0f) {
      memory.pixel[i] = static_cast<Index>(Memory::kNone);
      continue;
    }
    keep_fragment(memory, i, pixel, coverage);
    if (!coverage.is_full()) continue;
    const Word full = atomicOr(&memory.pixels[pixel], kUpperHalf) >> Memory::kHalf;
    if (full == Memory::kNone) continue;
    const int32_t added = atomicAdd(&memory.state->num_fragments, 1);
    if (added >= memory.max_fragments) continue;
    memory.face[added] = static_cast<Index>(full);
    memory.pixel[added] = static_cast<Index>(pixel);
    memory.samples_low[added] = memory.samples_high[added] = ~0u;
    keep_fragment(memory, added, pixel, {1.0f, kAllSamples});
  }
}

}  // namespace pictura::cuda
