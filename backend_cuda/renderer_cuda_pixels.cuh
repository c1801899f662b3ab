// From fragments to pixels: every two fragments of a pixel are asked what they hide of each other, then each pixel sums
// up what its fragments weigh.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_fragments.cuh"

namespace pictura::cuda {

// Turns the number of fragments of each pixel of a part into the place of its first among them all, and lists the
// pixels that have some. The pixel beyond the last has the place beyond the last. All threads of the block.
template <typename Memory>
__device__ void place_fragments(const Memory& memory, const Part& part) {
  using Index = typename Memory::Index;
  using Word = typename Memory::Word;
  BlockState* state = memory.state;
  const int pixels = part.num_pixels();
  // An odd number for each thread, so that threads read different banks.
  const int each = (pixels + num_threads() - 1) / num_threads() | 1;
  const int begin = min_of(static_cast<int>(threadIdx.x) * each, pixels), end = min_of(begin + each, pixels);
  int fragments = 0, drawn = 0;
  PICTURA_KEEP_LOOP
  for (int p = begin; p < end; ++p) {
    const int count = static_cast<int>(memory.pixels[p] & Memory::kNone);
    fragments += count;
    drawn += count > 0 ? 1 : 0;
  }
  int all_fragments = 0, all_drawn = 0;
  int place = sum_before(state->sum_of_warp[0], fragments, &all_fragments);
  int drawn_place = sum_before(state->sum_of_warp[1], drawn, &all_drawn);
  PICTURA_KEEP_LOOP
  for (int p = begin; p < end; ++p) {
    const Word word = memory.pixels[p];
    memory.pixels[p] = (word & ~Memory::kNone) | static_cast<Word>(place);
    place += static_cast<int>(word & Memory::kNone);
    if ((word & Memory::kNone) != 0) memory.drawn[drawn_place++] = static_cast<Index>(p);
  }
  if (threadIdx.x == 0) {
    memory.pixels[pixels] = static_cast<Word>(all_fragments);
    state->num_drawn = all_drawn;
  }
}

template <typename Memory>
__device__ int place_of(const Memory& memory, int pixel) {
  return static_cast<int>(memory.pixels[pixel] & Memory::kNone);
}

// Lists the fragments pixel by pixel.
template <typename Memory>
__device__ void order_fragments(const Memory& memory, int count) {
  using Index = typename Memory::Index;
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < count; i += num_threads()) {
    const Index pixel = memory.pixel[i];
    if (pixel == static_cast<Index>(Memory::kNone)) continue;
    memory.order[place_of(memory, pixel) + memory.rank[i]] = static_cast<Index>(i);
  }
}

// Whether, in the image that the block draws, a solid stands on a strip.
__device__ __noinline__ inline bool stands(uint32_t solid, uint32_t strip) {
  const GatheredImage& shown = block_state()->shown;
  const StaticGeometryView& pieces = shown.geometry->raster.pieces;
  return stands_on(extent_of(solid, pieces, shown.agents), extent_of(strip, pieces, shown.agents), shown.eye_m);
}

// Takes samples from a fragment's free ones.
template <typename Memory>
__device__ void lose(const Memory& memory, uint32_t fragment, uint64_t samples) {
  const auto low = static_cast<uint32_t>(samples), high = static_cast<uint32_t>(samples >> 32);
  if (low != 0) atomicAnd(&memory.free_low[fragment], ~low);
  if (high != 0) atomicAnd(&memory.free_high[fragment], ~high);
}

// Asks pairs of fragments what they hide of each other; b may be kNone, for the pixel's full face.
template <typename Memory>
__device__ __noinline__ void ask_pairs(WarpQueue::Pair pair, Part part) {
  if (!pair.is_one) return;
  const Memory memory = Memory::current();
  const int pixel = memory.pixel[pair.a];
  const bool with_full = pair.b == Memory::kNone;
  const size_t face_b = with_full ? full_of(memory, pixel) : memory.face[pair.b];
  const PixelCoverage a = memory.coverage(static_cast<int>(pair.a));
  const PixelCoverage b = with_full ? PixelCoverage{1.0f, kAllSamples} : memory.coverage(static_cast<int>(pair.b));
  const Vec2 corner{static_cast<float>(part.x_of(pixel)), static_cast<float>(part.y_of(pixel))};
  const Hidden hidden = hide_each_other(a, b, memory.faces[memory.face[pair.a]], memory.faces[face_b], corner,
                                        [](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
  lose(memory, pair.a, hidden.of_a);
  if (!with_full) lose(memory, pair.b, hidden.of_b);
}

// Asks every two fragments of a pixel that meet what they hide of each other; a pixel's full face is one of them. Pairs
// that meet are put aside until every lane of the warp has one. Fragments are dealt out: in a crowded pixel those of
// one face, which stand side by side, have many others each.
template <typename Memory>
__device__ void hide_fragments(const Memory& memory, const Part& part, int count) {
  using Index = typename Memory::Index;
  WarpState* warp = &memory.state->warps[warp_index()];
  WarpQueue pairs(&warp->pixels);
  const int deals = deals_of(count);
  PICTURA_KEEP_LOOP
  for (int deal = warp_index(); deal < deals; deal += num_warps()) {
    auto fragment_of = [&](int lane) { return lane * deals + deal; };
    const int i = fragment_of(lane_index());
    int others = 0, rank = 0, place = 0;
    if (i < count && memory.pixel[i] != static_cast<Index>(Memory::kNone)) {
      const int pixel = memory.pixel[i];
      place = place_of(memory, pixel);
      rank = memory.rank[i];
      others = rank + (full_of(memory, pixel) != Memory::kNone ? 1 : 0);
    }
    share_out(warp, others, [&](int owner, int k) {
      const int from = max_of(owner, 0);
      const int its_rank = __shfl_sync(kAllLanes, rank, from), its_place = __shfl_sync(kAllLanes, place, from);
      bool meet = false;
      uint32_t other = static_cast<uint32_t>(Memory::kNone);
      if (owner >= 0) {
        meet = k == its_rank;
        if (!meet) {
          other = static_cast<uint32_t>(memory.order[its_place + k]);
          const PixelCoverage coverage = memory.coverage(fragment_of(owner));
          meet = shared_samples(coverage, memory.coverage(static_cast<int>(other))) != 0;
        }
      }
      pairs.push(meet, static_cast<uint32_t>(fragment_of(from)), other);
      if (pairs.is_ready()) ask_pairs<Memory>(pairs.take(), part);
    });
  }
  if (!pairs.is_empty()) ask_pairs<Memory>(pairs.take(), part);
}

/// Hears of no fragment's weight.
struct NoVisit {
  static constexpr bool kWanted = false;
  __device__ void operator()(const ScreenFace&, float) const {}
};

// Weighs fragments: what is free of them is not needed from then on.
template <typename Memory>
__device__ void weigh_fragments(const Memory& memory, int count) {
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < count; i += num_threads()) {
    const PixelSum::Weight weight = PixelSum::weight_of(memory.coverage(i), memory.free(i));
    memory.area[i] = weight.area;
    memory.kind[i] = weight.kind;
  }
}

// The colour of a pixel that has fragments: visit(face, weight) hears of each.
template <typename Memory, typename Visit>
__device__ Rgb mix_pixel(const Memory& memory, int pixel, const Visit& visit) {
  const auto full = full_of(memory, pixel);
  const int begin = place_of(memory, pixel), end = place_of(memory, pixel + 1);
  auto face_of = [&](int i) -> const ScreenFace& { return memory.faces[memory.face[i]]; };
  auto weight_of = [&](int i) { return PixelSum::Weight{memory.area[i], static_cast<PixelSum::Kind>(memory.kind[i])}; };
  if (end - begin == 1 && full == Memory::kNone) {
    const int i = memory.order[begin];
    visit(face_of(i), memory.area[i]);
    return face_of(i).color * memory.area[i];
  }
  // Nothing hides the full face but what covers the pixel too, and then it is a fragment.
  const PixelSum::Weight of_full = PixelSum::weight_of({1.0f, kAllSamples}, kAllSamples);
  PixelSum sum;
  if (full != Memory::kNone) sum.add(of_full, memory.faces[full].color);
  PICTURA_KEEP_LOOP
  for (int at = begin; at < end; ++at) {
    const int i = memory.order[at];
    sum.add(weight_of(i), face_of(i).color);
  }
  const PixelSum::Shares shares = sum.shares();
  if constexpr (Visit::kWanted) {
    if (full != Memory::kNone) visit(memory.faces[full], shares.of(of_full));
    PICTURA_KEEP_LOOP
    for (int at = begin; at < end; ++at) {
      const int i = memory.order[at];
      visit(face_of(i), shares.of(weight_of(i)));
    }
  }
  return sum.color(shares);
}

// Finishes the pixels of a part: those without fragments first, then those that have some.
template <typename Memory, typename Visit, typename Finish>
__device__ void finish_pixels(const Memory& memory, const Part& part, const Visit& visit, Finish&& finish) {
  const int pixels = part.num_pixels(), num_drawn = memory.state->num_drawn;
  PICTURA_KEEP_LOOP
  for (int pixel = static_cast<int>(threadIdx.x); pixel < pixels; pixel += num_threads()) {
    const int x = part.x_of(pixel), y = part.y_of(pixel);
    if (x < part.x_begin || x >= part.x_end || place_of(memory, pixel) != place_of(memory, pixel + 1)) continue;
    const auto full = full_of(memory, pixel);
    Rgb color;
    if (full != Memory::kNone) {
      const ScreenFace& face = memory.faces[full];
      visit(face, 1.0f);
      color = face.color;
    }
    finish(x, y, color);
  }
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < num_drawn; i += num_threads()) {
    const int pixel = memory.drawn[i];
    finish(part.x_of(pixel), part.y_of(pixel), mix_pixel(memory, pixel, visit));
  }
}

// Draws the faces into one part. False where it has no room for all that it lists. All threads of the block.
template <typename Memory, typename Visit, typename Finish>
__device__ bool draw_part(const Memory& memory, int num_faces, const Part& part, const Visit& visit, Finish&& finish) {
  BlockState* state = memory.state;
  const int pixels = part.num_pixels();
  sync_block();
  PICTURA_KEEP_LOOP
  for (int p = static_cast<int>(threadIdx.x); p < pixels; p += num_threads()) memory.pixels[p] = 0;
  if (threadIdx.x == 0) state->num_rows = state->num_candidates = state->num_fragments = state->next_batch = 0;
  sync_block();
  list_rows(memory, num_faces, part);
  sync_block();
  if (state->num_rows > memory.max_rows) return false;
  mark_and_list(memory, part);
  sync_block();
  if (state->num_candidates > memory.max_candidates) return false;
  start_counts(memory, part);
  sync_block();
  make_fragments(memory, part);
  sync_block();
  const int made = state->num_fragments;
  if (made > memory.max_fragments) return false;
  sync_block();
  finish_fragments(memory, made);
  sync_block();
  const int count = state->num_fragments;
  if (count > memory.max_fragments) return false;
  place_fragments(memory, part);
  sync_block();
  order_fragments(memory, count);
  sync_block();
  hide_fragments(memory, part, count);
  sync_block();
  weigh_fragments(memory, count);
  sync_block();
  finish_pixels(memory, part, visit, finish);
  return true;
}

// Draws the faces into rows [y_first, y_last), in parts for which there is room. visit(face, weight) hears of each
// fragment, finish(x, y, color) of each pixel. False where there is no room for a single pixel. All threads of the
// block.
template <typename Memory, typename Visit, typename Finish>
__device__ bool draw_faces(const Memory& memory, int num_faces, int y_first, int y_last, const Visit& visit,
                           Finish&& finish) {
  const int width = image_width(), most_rows = memory.max_pixels / width;
  int x = 0, y = y_first, rows = most_rows, columns = width;
  PICTURA_KEEP_LOOP
  while (y < y_last) {
    const Part part{y, min_of(y + rows, y_last), x, min_of(x + columns, width)};
    if (!draw_part(memory, num_faces, part, visit, finish)) {
      if (rows == 1 && columns == 1) return false;
      if (rows == 1) columns = (columns + 1) / 2;
      rows = (rows + 1) / 2;
      continue;
    }
    x = part.x_end % width;
    if (x != 0) continue;
    y = part.y_end;
    columns = width;
    rows = min_of(2 * rows, most_rows);
  }
  return true;
}

}  // namespace pictura::cuda
