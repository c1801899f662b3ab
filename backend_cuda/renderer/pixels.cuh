// From fragments to pixels: resolves the occlusion among a pixel's fragments, then composites the pixel.
#pragma once

#include "pictura/backend_cuda/renderer/fragments.cuh"

namespace pictura::cuda {

__device__ __noinline__ inline bool stands(uint32_t solid, uint32_t strip) {
  const PreparedImage& image = block_state()->current;
  const StaticGeometryView& pieces = image.geometry->pieces;
  return stands_on(extent_of(solid, pieces, image.agents), extent_of(strip, pieces, image.agents));
}

template <typename Memory>
__device__ void clear_visible_samples(const Memory& memory, uint32_t fragment, uint64_t samples) {
  const auto low = static_cast<uint32_t>(samples), high = static_cast<uint32_t>(samples >> 32);
  if (low != 0) atomicAnd(&memory.visible_low[fragment], ~low);
  if (high != 0) atomicAnd(&memory.visible_high[fragment], ~high);
}

// pair.b: kNone for the pixel's full face.
template <typename Memory>
__device__ __noinline__ void resolve_pairs(WarpQueue::Pair pair, Part part) {
  if (!pair.is_valid) return;
  const Memory memory = Memory::current();
  const int pixel = memory.pixel[pair.a];
  const bool with_full = pair.b == Memory::kNone;
  const size_t face_b = with_full ? full_of(memory, pixel) : memory.face[pair.b];
  const PixelCoverage a = memory.coverage(static_cast<int>(pair.a));
  const PixelCoverage b = with_full ? PixelCoverage{1.0f, kAllSamples} : memory.coverage(static_cast<int>(pair.b));
  const Vec2 corner{static_cast<float>(part.x_of(pixel)), static_cast<float>(part.y_of(pixel))};
  const OccludedSamples occluded = occlude_pair(a, b, memory.faces[memory.face[pair.a]], memory.faces[face_b], corner,
                                                [](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
  clear_visible_samples(memory, pair.a, occluded.of_a);
  if (!with_full) clear_visible_samples(memory, pair.b, occluded.of_b);
}

// Resolves the occlusion among each pixel's fragments and its full face. A lane takes a fragment and walks the rest of
// its list. Later fragments come first, because their lists are longest. Overlapping pairs are queued until every lane
// has one.
template <typename Memory>
__device__ void resolve_occlusion(const Memory& memory, const Part& part, int count) {
  WarpQueue pairs(&memory.state->warps[warp_index()].queue);
  int begin = 0, used = kWarpSize;  // first of the warp's 32 fragments, and how many are taken
  int fragment = 0;
  uint32_t other = Memory::kNone;  // next fragment of the list
  bool is_before_full = false;     // the pair with the full face comes first
  uint64_t samples = 0;
  PICTURA_NO_UNROLL
  for (;;) {
    const bool is_idle = !is_before_full && other == Memory::kNone;
    const unsigned idle = __ballot_sync(kAllLanes, is_idle);
    if (idle == kAllLanes && begin >= count) break;
    if (used >= kWarpSize && begin < count) {
      begin = warp_next(&memory.state->next_fragments) * kWarpSize;
      used = 0;
    }
    const int index = used + __popc(idle & lanes_below());
    used += __popc(idle);
    if (is_idle && index < kWarpSize && begin + index < count) {
      fragment = count - 1 - (begin + index);
      samples = memory.samples(fragment);
      other = memory.next[fragment];
      is_before_full = full_of(memory, memory.pixel[fragment]) != Memory::kNone;
    }
    uint32_t partner = Memory::kNone;
    bool may_overlap = is_before_full && memory.visible(fragment) != 0;
    if (!is_before_full && other != Memory::kNone) {
      partner = other;
      const auto its_index = static_cast<int>(partner);
      may_overlap =
          may_occlude_more(memory.visible(fragment), samples, memory.visible(its_index), memory.samples(its_index));
      other = memory.next[partner];
    }
    is_before_full = false;
    pairs.push(may_overlap, static_cast<uint32_t>(fragment), partner);
    if (pairs.is_ready()) resolve_pairs<Memory>(pairs.take(), part);
  }
  if (!pairs.is_empty()) resolve_pairs<Memory>(pairs.take(), part);
}

// Calls divide_remainder() for each pixel with a fragment that covers it fully, in the thread of the first such
// fragment of the pixel's list.
template <typename Memory>
__device__ __noinline__ void divide_remainders(int count) {
  const Memory memory = Memory::current();
  PICTURA_NO_UNROLL
  for (int i = static_cast<int>(threadIdx.x); i < count; i += Memory::kThreads) {
    if (!memory.coverage(i).is_full()) continue;
    auto first = first_of(memory, memory.pixel[i]);
    while (!memory.coverage(static_cast<int>(first)).is_full()) first = memory.next[first];
    if (static_cast<int>(first) != i) continue;
    divide_remainder([&](auto&& visit) {
      PICTURA_NO_UNROLL
      for (auto at = first_of(memory, memory.pixel[i]); at != Memory::kNone; at = memory.next[at]) {
        const auto fragment = static_cast<int>(at);
        uint64_t visible = memory.visible(fragment);
        visit(memory.coverage(fragment), &visible);
        memory.visible_low[fragment] = static_cast<uint32_t>(visible);
        memory.visible_high[fragment] = static_cast<uint32_t>(visible >> 32);
      }
    });
  }
}

struct NoVisit {
  static constexpr bool kWanted = false;
  __device__ void operator()(const ScreenFace&, float) const {}
};

// Computes the fragments' weights. A fragment that is alone in its pixel gives the colour directly. Otherwise, its
// contribution and kind of weight overwrite its samples and pixel index.
template <typename Memory, typename Visit, typename Write>
__device__ void compute_weights(const Memory& memory, int count, const Visit& visit, const Write& write) {
  PICTURA_NO_UNROLL
  for (int i = static_cast<int>(threadIdx.x); i < count; i += Memory::kThreads) {
    const ScreenFace& face = memory.faces[memory.face[i]];
    const Rgb color = face.color;
    if (is_alone(memory, i, memory.pixel[i])) {
      visit(face, memory.area[i]);
      write.store_color(memory, i, color * memory.area[i]);
      continue;
    }
    const PixelAccumulator::Weight weight = PixelAccumulator::weight_of(memory.coverage(i), memory.visible(i));
    memory.set_part(i, PixelAccumulator::part_of(weight, color));
    memory.area[i] = weight.area;
    memory.kind[i] = weight.kind;
  }
}

// Composites the pixels in memory.composited, and calls visit(face, weight) for each of their faces.
template <typename Memory, typename Visit, typename Write>
__device__ void composite_pixels(const Memory& memory, const Visit& visit, const Write& write) {
  const int num_composited = memory.state->num_composited;
  PICTURA_NO_UNROLL
  for (int d = static_cast<int>(threadIdx.x); d < num_composited; d += Memory::kThreads) {
    const int pixel = memory.composited[d];
    const auto full = full_of(memory, pixel);
    const auto head = static_cast<int>(first_of(memory, pixel));
    auto each_fragment = [&](auto&& take) {
      PICTURA_NO_UNROLL
      for (auto i = first_of(memory, pixel); i != Memory::kNone; i = memory.next[i]) {
        take(static_cast<int>(i), static_cast<PixelAccumulator::Kind>(memory.kind[i]));
      }
    };
    // Only another fully covering face can occlude the full face, and then the full face is a fragment too.
    const PixelAccumulator::Weight of_full = PixelAccumulator::weight_of({1.0f, kAllSamples}, kAllSamples);
    PixelAccumulator sum;
    if (full != Memory::kNone) sum.add(of_full, memory.faces[full].color);
    each_fragment([&](int i, PixelAccumulator::Kind kind) { sum.add(kind, memory.part(i)); });
    const PixelAccumulator::Shares shares = sum.shares();
    if constexpr (Visit::kWanted) {
      if (full != Memory::kNone) visit(memory.faces[full], shares.of(of_full));
      each_fragment([&](int i, PixelAccumulator::Kind kind) {
        visit(memory.faces[memory.face[i]], shares.of({memory.area[i], kind}));
      });
    }
    write.store_color(memory, head, sum.color(shares));
  }
}

// Writes the pixels of a part and clears their words.
template <typename Memory, typename Visit, typename Write>
__device__ void write_pixels(const Memory& memory, const Part& part, const Visit& visit, const Write& write) {
  using Word = typename Memory::Word;
  const int pixels = part.num_pixels();
  PICTURA_NO_UNROLL
  for (int first = kPixelsPerWrite * static_cast<int>(threadIdx.x); first < pixels;
       first += kPixelsPerWrite * Memory::kThreads) {
    const int x = part.x_of(first), y = part.y_of(first), count = min_of(part.x_end - x, kPixelsPerWrite);
    Word word[kPixelsPerWrite];
    for (int i = 0; i < kPixelsPerWrite; ++i) {
      word[i] = memory.pixels[first + i];
      memory.pixels[first + i] = 0;
      if constexpr (Visit::kWanted) {
        const Word full = full_of_word<Memory>(word[i]);
        if (i < count && full != Memory::kNone && first_of_word<Memory>(word[i]) == Memory::kNone) {
          visit(memory.faces[full], 1.0f);
        }
      }
    }
    if (count > 0) write.pixels(memory, x, y, count, word);
  }
}

template <typename Memory>
__device__ void reset_counts(const Memory& memory) {
  BlockState* state = memory.state;
  if (threadIdx.x != 0) return;
  state->num_rows = state->num_candidates = state->num_fragments = state->num_added = state->divides = 0;
  state->num_composited = state->next_fragments = 0;
}
// Collective over the block.
template <typename Memory>
__device__ void reset_part(const Memory& memory) {
  sync_block();
  PICTURA_NO_UNROLL
  for (int p = static_cast<int>(threadIdx.x); p < memory.max_pixels; p += Memory::kThreads) memory.pixels[p] = 0;
  reset_counts(memory);
  sync_block();
}

// Returns false if the fragments do not fit into memory. Collective over the block.
template <typename Memory, typename Visit, typename Write>
__device__ bool draw_rows(const Memory& memory, const Part& part, const Visit& visit, const Write& write) {
  BlockState* state = memory.state;
  if (state->num_rows > memory.max_rows) return false;
  mark_and_list(memory, part);
  sync_block();
  if (state->num_candidates > memory.max_candidates) return false;
  make_fragments(memory, part);
  sync_block();
  const int made = state->num_fragments;
  if (made > memory.max_fragments) return false;
  finish_fragments(memory, made);
  sync_block();
  const int count = made + state->num_added;
  if (count > memory.max_fragments) return false;
  resolve_occlusion(memory, part, count);
  sync_block();
  if (state->divides != 0) {
    divide_remainders<Memory>(count);
    sync_block();
  }
  compute_weights(memory, count, visit, write);
  sync_block();
  composite_pixels(memory, visit, write);
  sync_block();
  return true;
}

// Draws the faces into a part and clears the memory. Returns false, without clearing, if the part does not fit.
// Collective over the block; the caller synchronizes before the next part.
template <typename Memory, typename Visit, typename Write>
__device__ bool draw_part(const Memory& memory, int num_faces, const Part& part, const Visit& visit,
                          const Write& write) {
  list_rows(memory, num_faces, part);
  sync_block();
  // Without rows, the counters are already 0. A reset would race with threads that still read num_rows.
  if (memory.state->num_rows != 0) {
    if (!draw_rows(memory, part, visit, write)) return false;
    reset_counts(memory);
  }
  write_pixels(memory, part, visit, write);
  return true;
}

// Plans the next part of a tile. Parts that do not fit become narrower, then lower, because distant primitives lie
// along the horizon. Returns false if a single pixel does not fit. Collective over the block.
template <typename Memory>
__device__ __noinline__ bool plan_next_part(Part whole, Part part, bool is_drawn) {
  constexpr int kNarrowPart_px = 2 * kPixelsPerWrite;
  const Memory memory = Memory::current();
  auto half_of = [](int size) { return (size + 1) / 2; };
  sync_block();
  if (threadIdx.x == 0) {
    PartPlan& plan = memory.state->plan;
    const int columns = part.num_columns(), rows = part.num_rows();
    if (columns == whole.num_columns() && rows == whole.num_rows()) plan = {whole.x_begin, columns, columns, rows};
    int x = part.x_begin, y = part.y_begin;
    if (is_drawn) {
      // The next part is to the right within the band, else below in the band, else at the top of the next band.
      const int band_end = min_of(plan.band_begin + plan.band_px, whole.x_end);
      x = part.x_end;
      if (x == band_end) {
        plan.wide_px = plan.band_px;
        plan.rows = min_of(2 * plan.rows, whole.num_rows());
        y = part.y_end;
        if (y == whole.y_end) {
          plan.band_begin = band_end;
          plan.rows = whole.num_rows();
          y = whole.y_begin;
        }
        x = plan.band_begin;
      }
    } else if (rows == whole.num_rows() && columns > kNarrowPart_px) {
      plan.band_px = plan.wide_px = (half_of(columns) + kPixelsPerWrite - 1) / kPixelsPerWrite * kPixelsPerWrite;
    } else if (rows > 1) {
      plan.rows = half_of(rows);
    } else {
      // A part begins at a multiple of its width, so that a thread's pixels lie in one patch.
      plan.wide_px = columns > kPixelsPerWrite ? kPixelsPerWrite : columns > 2 ? 2 : 1;
    }
    plan.part = {x, min_of(x + plan.wide_px, min_of(plan.band_begin + plan.band_px, whole.x_end)), y,
                 min_of(y + plan.rows, whole.y_end)};
  }
  if (is_drawn) {
    sync_block();
  } else {
    reset_part(memory);
  }
  return is_drawn || part.num_columns() > 1 || part.num_rows() > 1;
}

// Draws the faces into a part of an image, in smaller parts if it does not fit. `visit` gets the weights of faces, and
// `write` the pixels (see NoVisit, ImageWriter). Returns false if a single pixel does not fit. Collective over the
// block; the caller synchronizes before the next call.
template <typename Memory, typename Visit, typename Write>
__device__ bool draw_faces(const Memory& memory, int num_faces, const Part& whole, const Visit& visit,
                           const Write& write) {
  Part part = whole;
  PICTURA_NO_UNROLL
  for (;;) {
    const bool is_drawn = draw_part(memory, num_faces, part, visit, write);
    if (is_drawn && part.x_end == whole.x_end && part.y_end == whole.y_end) return true;
    if (!plan_next_part<Memory>(whole, part, is_drawn)) return false;
    part = memory.state->plan.part;
  }
}

// Calls draw(memory, tile) for an image's tiles until a call returns false. Tiles are as high as the memory allows.
template <typename Memory, typename Draw>
__device__ bool for_each_tile(const Memory& memory, int width_px, int y_begin, int y_end, const Draw& draw) {
  const int max_rows = memory.max_pixels / kTileWidth_px;
  reset_part(memory);
  PICTURA_NO_UNROLL
  for (int y = y_begin; y < y_end; y += max_rows) {
    PICTURA_NO_UNROLL
    for (int x = 0; x < width_px; x += kTileWidth_px) {
      if (!draw(memory, tile_at(x, y, kTileWidth_px, max_rows, width_px, y_end))) return false;
      sync_block();
    }
  }
  return true;
}

}  // namespace pictura::cuda
