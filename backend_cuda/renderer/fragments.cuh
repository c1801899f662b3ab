// From faces to fragments. Threads first process rows of faces: they find each pixel's full face (the nearest fully
// covering face, by occluder_bound()), and list partly covered pixels as candidates. A candidate that may be visible
// becomes a fragment in its pixel's linked list.
#pragma once

#include "pictura/backend_cuda/renderer/draw_memory.cuh"
#include "pictura/backend_cuda/renderer/rig.cuh"
#include "pictura/common/portable/async_copy.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura::cuda {

__device__ inline Part tile_at(int x, int y, int columns, int rows, int width_px, int y_end) {
  return {x, min_of(x + columns, width_px), y, min_of(y + rows, y_end)};
}

/// Word of a pixel; 0 if it has neither a face nor a fragment. Lower bits: index of its full face plus 1. Upper bits:
/// the face's occluder bound, as bits that sort like it. If the sign bit is set, they hold the first fragment of the
/// pixel's list.
template <typename Word>
struct PixelWord {
  static constexpr int kFaceBits = sizeof(Word) == 4 ? kMarkedFaceBits : 32;
  static constexpr Word kFace = (Word{1} << kFaceBits) - 1, kHasFragments = Word{1} << (8 * sizeof(Word) - 1);

  __device__ static Word mark(float bound, int face) {
    static_assert(kMarkedFaceBits + kOccluderBoundBits == 32);
    return Word{bits_from_float(bound)} << (kFaceBits - kMarkedFaceBits) | static_cast<Word>(face + 1);
  }
  __device__ static int marked_face(Word mark) { return static_cast<int>(mark & kFace) - 1; }
  __device__ static float marked_bound(Word mark) {
    constexpr uint32_t kBoundMask = ~0u << kMarkedFaceBits;
    return float_from_bits(static_cast<uint32_t>(mark >> (kFaceBits - kMarkedFaceBits)) & kBoundMask);
  }
  /// Replaces the first fragment and keeps the face.
  __device__ static Word with_first(Word word, Word fragment) {
    return kHasFragments | fragment << kFaceBits | (word & kFace);
  }
};

// Returns the pixel's full face. Returns kNone if there is none, or if the face is in the pixel's fragment list.
template <typename Memory>
__device__ typename Memory::Word full_of_word(typename Memory::Word word) {
  return ((word & PixelWord<typename Memory::Word>::kFace) - 1) & Memory::kNone;
}
// Returns the first fragment of the pixel's list; kNone if the list is empty.
template <typename Memory>
__device__ typename Memory::Word first_of_word(typename Memory::Word word) {
  using Pixel = PixelWord<typename Memory::Word>;
  return (word & Pixel::kHasFragments) != 0 ? (word & ~Pixel::kHasFragments) >> Pixel::kFaceBits : Memory::kNone;
}
template <typename Memory>
__device__ typename Memory::Word full_of(const Memory& memory, int pixel) {
  return full_of_word<Memory>(memory.pixels[pixel]);
}
template <typename Memory>
__device__ typename Memory::Word first_of(const Memory& memory, int pixel) {
  return first_of_word<Memory>(memory.pixels[pixel]);
}

// Lists the rows of faces in a part. Rows beyond max_rows are counted but not stored. Collective over the block.
template <typename Memory>
__device__ void list_rows(const Memory& memory, int num_faces, const Part& part) {
  using Word = typename Memory::Word;
  WarpState* warp = &memory.state->warps[warp_index()];
  PICTURA_NO_UNROLL
  for (int first = warp_index() * kWarpSize; first < num_faces; first += Memory::kThreads) {
    const int face = first + lane_index();
    int y_begin = 0, rows = 0;
    if (face < num_faces) {
      const PixelBox box = memory.faces[face].box;
      y_begin = max_of(box.y_begin, part.y_begin);
      const bool is_outside = box.x_begin >= part.x_end || box.x_end <= part.x_begin;
      rows = is_outside ? 0 : max_of(0, min_of(box.y_end, part.y_end) - y_begin);
    }
    if (rows > 0) prefetch(memory.edges + memory.faces[face].edge_begin);
    const int end = warp_inclusive_sum(rows), row = y_begin - part.y_begin;
    const int32_t index = warp_allocate(&memory.state->num_rows, end);
    warp_expand(warp, rows, end, [&](int item, int owner, int k) {
      const int its_row = __shfl_sync(kAllLanes, row, max_of(owner, 0)) + k;
      if (owner >= 0 && index + item < memory.max_rows) {
        memory.rows[index + item] = static_cast<Word>(first + owner) << Memory::kHalf | static_cast<Word>(its_row);
      }
    });
  }
}

template <typename Memory>
__device__ void list_candidate(const Memory& memory, int index, int face, int pixel, bool covers_fully) {
  using Word = typename Memory::Word;
  if (index >= memory.max_candidates) return;
  memory.candidates[index] = static_cast<Word>(face) << Memory::kHalf | static_cast<Word>(pixel) |
                             (covers_fully ? Memory::kCoversFully : Word{0});
}

// Marks a pixel with a fully covering face, unless its current face has a larger occluder bound. Returns the face with
// the lower bound if it may still be visible, else -1.
template <typename Memory>
__device__ int mark_pixel(const Memory& memory, int face, int x, int y, int pixel) {
  using Word = typename Memory::Word;
  const Word mark = PixelWord<Word>::mark(occluder_bound(memory.faces[face], x, y), face);
  Word previous = memory.pixels[pixel];
  if (previous < mark) previous = atomicMax(&memory.pixels[pixel], mark);
  const int other = PixelWord<Word>::marked_face(previous);
  if (other < 0) return -1;
  const int farther = previous < mark ? other : face;
  const float bound = PixelWord<Word>::marked_bound(previous < mark ? mark : previous);
  return passes_occluder_bound(memory.faces[farther], bound, x, y) ? farther : -1;
}

// A row of a face within a tile: four column numbers relative to the tile, one byte each.
static_assert(kTileWidth_px <= 255);
struct TileSpan {
  uint32_t bytes = 0;
  TileSpan() = default;
  __device__ explicit TileSpan(uint32_t all) : bytes(all) {}
  __device__ TileSpan(const RowSpan& span, const Part& part) {
    auto within = [&](int32_t x) {
      return static_cast<uint32_t>(min_of(max_of(x, part.x_begin), part.x_end) - part.x_begin);
    };
    bytes = within(span.begin) | within(span.full_begin) << 8 | within(span.full_end) << 16 | within(span.end) << 24;
  }
  __device__ int begin() const { return static_cast<int>(bytes & 0xFF); }
  __device__ int full_begin() const { return static_cast<int>(bytes >> 8 & 0xFF); }
  __device__ int full_end() const { return static_cast<int>(bytes >> 16 & 0xFF); }
  __device__ int end() const { return static_cast<int>(bytes >> 24); }
  __device__ int num_full() const { return full_end() - full_begin(); }
  /// Returns the columns relative to the tile.
  __device__ RowSpan row() const { return {begin(), end(), full_begin(), full_end()}; }
  /// Returns the k-th partly covered column, left or right of the fully covered columns.
  __device__ int partial(int k) const { return begin() + k + (begin() + k < full_begin() ? 0 : num_full()); }
};

// A row of a face that a lane shares with its warp.
struct SharedRow {
  int face, y;
  TileSpan span;
  /// owner: lane that shares its row; -1: any lane.
  template <typename Memory>
  __device__ static SharedRow of(int owner, typename Memory::Word row, TileSpan span, const Part& part) {
    const int from = max_of(owner, 0);
    const typename Memory::Word its_row = __shfl_sync(kAllLanes, row, from);
    return {static_cast<int>(its_row >> Memory::kHalf), part.y_begin + static_cast<int>(its_row & Memory::kNone),
            TileSpan(__shfl_sync(kAllLanes, span.bytes, from))};
  }
};

// Calls visit(row, span) for the listed rows of faces, with a row per lane; lanes without a row get an empty
// span. The lanes of a warp take distant rows, because neighbouring rows often belong to one large face. Collective
// over the block.
template <typename Memory, typename Visit>
__device__ void for_each_row(const Memory& memory, const Part& part, const Visit& visit) {
  using Word = typename Memory::Word;
  const int num_rows = memory.state->num_rows, passes = passes_of<Memory::kThreads>(num_rows);
  PICTURA_NO_UNROLL
  for (int pass = warp_index(); pass < passes; pass += Memory::kThreads / kWarpSize) {
    const int at = lane_index() * passes + pass;
    Word row = 0;
    TileSpan span;
    if (at < num_rows) {
      row = memory.rows[at];
      const ScreenFace& face = memory.faces[row >> Memory::kHalf];
      const int y = part.y_begin + static_cast<int>(row & Memory::kNone);
      span = TileSpan(row_span(memory.edges + face.edge_begin, face.edge_count, face.box, y), part);
    }
    visit(row, span);
  }
}

// Marks each pixel of a part with its full face, and lists the partly covered pixels. Collective over the block.
template <typename Memory>
__device__ void mark_and_list(const Memory& memory, const Part& part) {
  using Word = typename Memory::Word;
  BlockState* state = memory.state;
  WarpState* warp = &state->warps[warp_index()];
  for_each_row(memory, part, [&](Word row, TileSpan span) {
    const int full = span.num_full(), partial = span.end() - span.begin() - full;
    // Both prefix sums in one word: neither reaches 2^16.
    const int ends = warp_inclusive_sum(full | partial << 16), full_end = ends & 0xFFFF, partial_end = ends >> 16;
    warp_expand(warp, full, full_end, [&](int, int owner, int k) {
      const SharedRow its = SharedRow::of<Memory>(owner, row, span, part);
      const int x = part.x_begin + its.span.full_begin() + k, pixel = part.pixel(x, its.y);
      const int farther = owner >= 0 ? mark_pixel(memory, its.face, x, its.y, pixel) : -1;
      if (!__any_sync(kAllLanes, farther >= 0)) return;
      const int32_t index = warp_allocate_one(&state->num_candidates, farther >= 0);
      if (farther >= 0) list_candidate(memory, index, farther, pixel, true);
    });
    const int32_t index = warp_allocate(&state->num_candidates, partial_end);
    warp_expand(warp, partial, partial_end, [&](int item, int owner, int k) {
      const SharedRow its = SharedRow::of<Memory>(owner, row, span, part);
      const int pixel = part.pixel(part.x_begin + its.span.partial(k), its.y);
      if (owner >= 0) list_candidate(memory, index + item, its.face, pixel, false);
    });
  });
}

// Whether a pixel has only this fragment and no full face.
template <typename Memory>
__device__ bool is_alone(const Memory& memory, int fragment, int pixel) {
  using Word = typename Memory::Word;
  return memory.pixels[pixel] == PixelWord<Word>::with_first(0, static_cast<Word>(fragment)) &&
         memory.next[fragment] == static_cast<typename Memory::Index>(Memory::kNone);
}

// Stores a fragment at the front of its pixel's list. No other thread may change the pixel's full face meanwhile.
template <typename Memory>
__device__ void store_fragment(const Memory& memory, int fragment, uint32_t face, int pixel, uint64_t samples,
                               float area) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  memory.samples_low[fragment] = static_cast<uint32_t>(samples);
  memory.samples_high[fragment] = static_cast<uint32_t>(samples >> 32);
  memory.area[fragment] = area;
  memory.face[fragment] = static_cast<Index>(face);
  memory.pixel[fragment] = static_cast<Index>(pixel);
  Word* const word = &memory.pixels[pixel];
  const Word before = atomicExch(word, PixelWord<Word>::with_first(*word, static_cast<Word>(fragment)));
  memory.next[fragment] = static_cast<Index>(first_of_word<Memory>(before));
}

template <typename Memory>
__device__ void make_fragment(const Memory& memory, WarpQueue::Pair candidate, const Part& part) {
  const int pixel = Memory::pixel_of(candidate.b);
  PixelCoverage coverage;
  if (candidate.is_valid) {
    const ScreenFace& face = memory.faces[candidate.a];
    coverage = Memory::covers_fully(candidate.b) ? PixelCoverage{1.0f, kAllSamples}
                                                 : pixel_coverage(memory.edges + face.edge_begin, face.edge_count,
                                                                  face.min_area(), part.x_of(pixel), part.y_of(pixel));
  }
  const bool is_covered = coverage.area > 0.0f;
  const int32_t fragment = warp_allocate_one(&memory.state->num_fragments, is_covered);
  if (!is_covered || fragment >= memory.max_fragments) return;
  store_fragment(memory, fragment, candidate.a, pixel, coverage.samples, coverage.area);
}

// Makes fragments from the candidates that pass their pixel's occluder bound. Warps queue candidates until every lane
// has one. Collective over the block.
template <typename Memory>
__device__ void make_fragments(const Memory& memory, const Part& part) {
  WarpQueue queue(&memory.state->warps[warp_index()].queue);
  const int count = memory.state->num_candidates;
  PICTURA_NO_UNROLL
  for (int first = warp_index() * kWarpSize;; first += Memory::kThreads) {
    const int i = first + lane_index();
    const bool more = i - lane_index() < count;
    bool is_visible = false;
    uint32_t face = 0, coded_pixel = 0;
    if (i < count) {
      const auto candidate = memory.candidates[i];
      face = static_cast<uint32_t>(candidate >> Memory::kHalf);
      coded_pixel = static_cast<uint32_t>(candidate & Memory::kNone);
      const int pixel = Memory::pixel_of(coded_pixel);
      const auto full = full_of(memory, pixel);
      const int x = part.x_of(pixel), y = part.y_of(pixel);
      is_visible = full == Memory::kNone ||
                   passes_occluder_bound(memory.faces[face], occluder_bound(memory.faces[full], x, y), x, y);
    }
    queue.push(is_visible, face, coded_pixel);
    if (queue.is_ready() || (!more && !queue.is_empty())) make_fragment(memory, queue.take(), part);
    if (!more) return;
  }
}

template <typename Memory, typename Wanted>
__device__ bool any_fragment(const Memory& memory, typename Memory::Word at, Wanted&& wanted) {
  PICTURA_NO_UNROLL
  for (; at != Memory::kNone; at = memory.next[at]) {
    if (wanted(memory.coverage(static_cast<int>(at)))) return true;
  }
  return false;
}

// Makes all effective_samples() of each fragment visible. If a fragment covers its pixel fully, the pixel's full face
// becomes a fragment too, because the two may intersect. Lists the pixels with several fragments, or with a fragment
// and a full face. Sets state->divides if several fragments cover a pixel fully, and another covers it partly and is no
// sliver.
template <typename Memory>
__device__ void finish_fragments(const Memory& memory, int count) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  auto set_all_visible = [&](int fragment) {
    const uint64_t samples = effective_samples(memory.coverage(fragment));
    memory.visible_low[fragment] = static_cast<uint32_t>(samples);
    memory.visible_high[fragment] = static_cast<uint32_t>(samples >> 32);
  };
  PICTURA_NO_UNROLL
  for (int first = warp_index() * kWarpSize; first < count; first += Memory::kThreads) {
    const int i = first + lane_index();
    // The thread of a list's last fragment adds the pixel.
    const bool is_listed =
        i < count && memory.next[i] == static_cast<Index>(Memory::kNone) && !is_alone(memory, i, memory.pixel[i]);
    const int32_t index = warp_allocate_one(&memory.state->num_composited, is_listed);
    if (is_listed) memory.composited[index] = memory.pixel[i];
    if (i >= count) continue;
    set_all_visible(i);
    if (!memory.coverage(i).is_full()) continue;
    const int pixel = memory.pixel[i];
    const Word before = atomicAnd(&memory.pixels[pixel], ~PixelWord<Word>::kFace), full = full_of_word<Memory>(before);
    auto is_full = [](const PixelCoverage& coverage) { return coverage.is_full(); };
    auto hides = [](const PixelCoverage& coverage) { return !coverage.is_full() && coverage.samples != 0; };
    const Word first_of_list = first_of_word<Memory>(before);
    // The first of several full fragments finds the others. If another thread has just put the full face at the front
    // of the list, the list may not be linked yet; then only the other thread decides about `divides`.
    if ((full != Memory::kNone || any_fragment(memory, Word{memory.next[i]}, is_full)) &&
        first_of_list < static_cast<Word>(count) && any_fragment(memory, first_of_list, hides)) {
      atomicOr(&memory.state->divides, 1);
    }
    if (full == Memory::kNone) continue;
    const int32_t added = count + atomicAdd(&memory.state->num_added, 1);
    if (added >= memory.max_fragments) continue;
    store_fragment(memory, added, static_cast<uint32_t>(full), pixel, kAllSamples, 1.0f);
    set_all_visible(added);
  }
}

}  // namespace pictura::cuda
