// From the faces of an image to its pixels. What a face covers of a pixel is a fragment; each pixel has a list of them,
// and the nearest face that covers it fully, behind which nothing can be seen. Every two fragments of a pixel are asked
// what they hide of each other; then each pixel sums up what its fragments weigh.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_memory.cuh"

namespace pictura::cuda {

/// Rows [y_begin, y_end) of an image, or columns [x_begin, x_end) of one row; the first row's first pixel is the
/// block's pixel `offset`.
struct Band {
  int width, y_begin, y_end, x_begin, x_end, offset;
  __device__ int pixel(int x, int y) const { return offset + (y - y_begin) * width + x; }
  __device__ int x_of(int pixel) const { return (pixel - offset) % width; }
  __device__ int y_of(int pixel) const { return y_begin + (pixel - offset) / width; }
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

// The faces that a warp works on: 32 at a time, far apart in the list, because large ones stand side by side in it.
struct FaceBatch {
  int index, count;  // of so many batches
  __device__ int face(int slot) const { return slot * count + index; }
};

// Edges of a face of the warp's batch.
template <typename Memory>
__device__ const PolygonEdge* edges_of(const Memory& memory, const WarpState* warp, int slot) {
  return warp->edge_count[slot] <= kNearEdges ? warp->edges[slot] : memory.edges + warp->edge_begin[slot];
}

// The row of a face of the warp's batch. One copy of its code serves all passes.
template <typename Memory>
__device__ __noinline__ RowSpan row_of(int slot, int face, int y) {
  const Memory memory = Memory::current();
  const WarpState* warp = &memory.state->warps[warp_index()];
  return row_span(edges_of(memory, warp, slot), warp->edge_count[slot], memory.faces[face].box, y);
}

// Shares out the rows of the faces in a band: warps take batches of faces, and lanes get a job each, which also stands
// in warp->jobs; visit(batch, job) is called by all lanes, and end_batch() after each batch. The job of a lane that got
// none touches nothing. state->next_batch is 0 before.
template <typename Memory, typename Visit, typename EndBatch>
__device__ void visit_rows(const Memory& memory, int num_faces, const Band& band, Visit&& visit, EndBatch&& end_batch) {
  BlockState* state = memory.state;
  WarpState* warp = &state->warps[warp_index()];
  const int lane = lane_index();
  FaceBatch batch{0, (num_faces + kWarpSize - 1) / kWarpSize};
  PICTURA_KEEP_LOOP
  for (;;) {
    if (lane == 0) batch.index = atomicAdd(&state->next_batch, 1);
    batch.index = __shfl_sync(kAllLanes, batch.index, 0);
    if (batch.index >= batch.count) return;
    const int i = batch.face(lane);
    int row_begin = 0, rows = 0;
    if (i < num_faces) {
      const ScreenFace& face = memory.faces[i];
      row_begin = max_of(face.box.y_begin, band.y_begin);
      if (face.box.x_begin < band.x_end && face.box.x_end > band.x_begin) {
        rows = max_of(0, min_of(face.box.y_end, band.y_end) - row_begin);
      }
      if (rows > 0) {
        warp->edge_begin[lane] = face.edge_begin;
        warp->edge_count[lane] = face.edge_count;
        PICTURA_KEEP_LOOP
        for (int e = 0; e < min_of(face.edge_count, kNearEdges); ++e) {
          warp->edges[lane][e] = memory.edges[face.edge_begin + e];
        }
      }
    }
    share_out(warp, rows, [&](int slot, int k) {
      const int y = __shfl_sync(kAllLanes, row_begin, max_of(slot, 0)) + k;
      RowJob job{};
      if (slot >= 0) {
        const int face = batch.face(slot);
        const RowSpan span = row_of<Memory>(slot, face, y);
        auto within = [&](int x) { return static_cast<uint16_t>(min_of(max_of(x, band.x_begin), band.x_end)); };
        job = {face,
               static_cast<uint16_t>(slot),
               static_cast<uint16_t>(y),
               within(span.begin),
               within(span.end),
               within(span.full_begin),
               within(span.full_end)};
      }
      __syncwarp();
      warp->jobs[lane] = job;
      __syncwarp();
      visit(batch, job);
    });
    end_batch(batch);
    __syncwarp();
  }
}

// Marks, in a band, the nearest face that covers each pixel fully, and counts the pixels of each row that faces cover
// partly.
template <typename Memory>
__device__ void mark_full(const Memory& memory, int num_faces, const Band& band) {
  WarpState* warp = &memory.state->warps[warp_index()];
  auto mark = [&](FaceBatch, const RowJob& job) {
    const int full = job.full_end - job.full_begin, partial = job.end - job.begin - full;
    if (partial > 0) atomicAdd(&memory.state->row_partial[job.y - band.y_begin], partial);
    share_out(warp, full, [&](int owner, int k) {
      if (owner < 0) return;
      const RowJob& row = warp->jobs[owner];
      const int x = row.full_begin + k;
      const auto nearest =
          full_mark<typename Memory::Word>(middle_nearness(memory.faces[row.face], x, row.y), row.face);
      typename Memory::Word* pixel = &memory.pixels[band.pixel(x, row.y)];
      if (*pixel < nearest) atomicMax(pixel, nearest);
    });
  };
  visit_rows(memory, num_faces, band, mark, [](FaceBatch) {});
}

// The face that covers a pixel fully and hides what is behind it; kNone where there is none, or where it stands among
// the pixel's fragments, because another one that covers the pixel fully may intersect it.
template <typename Memory>
__device__ typename Memory::Word full_of(const Memory& memory, int pixel) {
  const bool is_listed = (memory.full_listed[pixel / 32] >> (pixel % 32) & 1u) != 0;
  return is_listed ? Memory::kNone : memory.pixels[pixel] >> Memory::kHalf;
}
// True for one of those who ask to put a pixel's full face among its fragments.
template <typename Memory>
__device__ bool list_full(const Memory& memory, int pixel) {
  const uint32_t bit = 1u << (pixel % 32);
  return (atomicOr(&memory.full_listed[pixel / 32], bit) & bit) == 0;
}
template <typename Memory>
__device__ void forget_listed(const Memory& memory) {
  PICTURA_KEEP_LOOP
  for (int w = static_cast<int>(threadIdx.x); w <= memory.max_pixels / 32; w += kThreads) memory.full_listed[w] = 0;
}

// Turns the marks of a band into what pixels hold from then on: in the upper half the full face (kNone: none), in the
// lower half the head of the list of fragments.
template <typename Memory>
__device__ void start_lists(const Memory& memory, int count) {
  using Word = typename Memory::Word;
  PICTURA_KEEP_LOOP
  for (int p = static_cast<int>(threadIdx.x); p < count; p += kThreads) {
    const int face = marked_face(memory.pixels[p]);
    const Word full = face < 0 ? Memory::kNone : static_cast<Word>(face);
    memory.pixels[p] = full << Memory::kHalf | Memory::kNone;
  }
  forget_listed(memory);
}

// Stores the fragments of those lanes that have one, and links them to their pixels. Those that find no room are
// counted, and the band is drawn again in smaller parts.
template <typename Memory>
__device__ __noinline__ void store_fragment(bool has_one, PixelCoverage coverage, int face, int pixel) {
  using Word = typename Memory::Word;
  using Index = typename Memory::Index;
  const Memory memory = Memory::current();
  const int32_t slot = take_place(&memory.state->num_fragments, has_one);
  if (!has_one || slot >= memory.max_fragments) return;
  const uint64_t reach = reach_of(coverage);
  memory.samples_low[slot] = static_cast<uint32_t>(coverage.samples);
  memory.samples_high[slot] = static_cast<uint32_t>(coverage.samples >> 32);
  memory.free_low[slot] = static_cast<uint32_t>(reach);
  memory.free_high[slot] = static_cast<uint32_t>(reach >> 32);
  memory.area[slot] = coverage.area;
  memory.face[slot] = static_cast<Index>(face);
  memory.pixel[slot] = static_cast<Index>(pixel);
  const Word kept = memory.pixels[pixel] & ~Memory::kNone;
  const Word head = atomicExch(&memory.pixels[pixel], kept | static_cast<Word>(slot)) & Memory::kNone;
  memory.next[slot] = static_cast<Index>(head);
}

// Computes what faces of the warp's batch cover of pixels that they cover partly: pairs of a face's slot and a pixel.
template <typename Memory>
__device__ __noinline__ void cover_pixels(WarpQueue::Pair pair, FaceBatch batch, Band band) {
  const Memory memory = Memory::current();
  const WarpState* warp = &memory.state->warps[warp_index()];
  const int slot = static_cast<int>(pair.a), pixel = static_cast<int>(pair.b);
  PixelCoverage coverage;
  if (pair.is_one) {
    coverage = pixel_coverage(edges_of(memory, warp, slot), warp->edge_count[slot], band.x_of(pixel), band.y_of(pixel));
  }
  store_fragment<Memory>(coverage.area > 0.0f, coverage, batch.face(slot), pixel);
}

// Computes what faces cover of the pixels of a band. Pixels that a face covers partly are put aside until every lane of
// the warp has one.
template <typename Memory>
__device__ void make_fragments(const Memory& memory, int num_faces, const Band& band) {
  WarpState* warp = &memory.state->warps[warp_index()];
  WarpQueue queue(warp);
  auto full_face = [&](int pixel) -> const ScreenFace* {
    const auto full = memory.pixels[pixel] >> Memory::kHalf;
    return full == Memory::kNone ? nullptr : &memory.faces[full];
  };
  auto visit = [&](FaceBatch batch, const RowJob& job) {
    const int full = job.full_end - job.full_begin;
    share_out(warp, job.end - job.begin - full, [&](int owner, int k) {
      bool wanted = false;
      int slot = 0, pixel = 0;
      if (owner >= 0) {
        const RowJob& row = warp->jobs[owner];
        const int lead = row.full_begin - row.begin;
        const int x = k < lead ? row.begin + k : row.full_end + (k - lead);
        slot = row.slot;
        pixel = band.pixel(x, row.y);
        const ScreenFace* hiding = full_face(pixel);
        wanted = !hiding || may_show_before(memory.faces[row.face], *hiding, x, row.y, false);
      }
      queue.push(wanted, static_cast<uint32_t>(slot), static_cast<uint32_t>(pixel));
      if (queue.is_ready()) cover_pixels<Memory>(queue.take(), batch, band);
    });
    share_out(warp, full, [&](int owner, int k) {
      bool shows = false, lists = false;
      int face = 0, full = 0, pixel = 0;
      if (owner >= 0) {
        const RowJob& row = warp->jobs[owner];
        const int x = row.full_begin + k;
        face = row.face;
        pixel = band.pixel(x, row.y);
        full = static_cast<int>(memory.pixels[pixel] >> Memory::kHalf);
        shows = full != face && may_show_before(memory.faces[face], memory.faces[full], x, row.y, true);
        lists = shows && list_full(memory, pixel);
      }
      if (__any_sync(kAllLanes, shows)) store_fragment<Memory>(shows, {1.0f, kAllSamples}, face, pixel);
      if (__any_sync(kAllLanes, lists)) store_fragment<Memory>(lists, {1.0f, kAllSamples}, full, pixel);
    });
  };
  visit_rows(memory, num_faces, band, visit, [&](FaceBatch batch) {
    if (!queue.is_empty()) cover_pixels<Memory>(queue.take(), batch, band);
  });
}

// Whether, in the image that the block draws, a solid stands on a strip.
__device__ __noinline__ inline bool stands(const DrawTask* task, uint32_t solid, uint32_t strip) {
  const ViewState& view = block_state()->view;
  const StaticGeometryView& pieces = view.geometry->raster.pieces;
  return stands_on(extent_of(solid, pieces, task->scene, view.world_begin),
                   extent_of(strip, pieces, task->scene, view.world_begin), block_state()->setting.camera.position_m);
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
__device__ __noinline__ void ask_pairs(const DrawTask* task, WarpQueue::Pair pair, Band band) {
  if (!pair.is_one) return;
  const Memory memory = Memory::current();
  const int pixel = memory.pixel[pair.a];
  const bool with_full = pair.b == Memory::kNone;
  const size_t face_b = with_full ? full_of(memory, pixel) : memory.face[pair.b];
  const PixelCoverage a = memory.coverage(static_cast<int>(pair.a));
  const PixelCoverage b = with_full ? PixelCoverage{1.0f, kAllSamples} : memory.coverage(static_cast<int>(pair.b));
  const Vec2 corner{static_cast<float>(band.x_of(pixel)), static_cast<float>(band.y_of(pixel))};
  const Hidden hidden = hide_each_other(a, b, memory.faces[memory.face[pair.a]], memory.faces[face_b], corner,
                                        [&](uint32_t solid, uint32_t strip) { return stands(task, solid, strip); });
  lose(memory, pair.a, hidden.of_a);
  if (!with_full) lose(memory, pair.b, hidden.of_b);
}

// Asks every two fragments of a pixel that meet what they hide of each other; a pixel's full face is one of them. Pairs
// that meet are put aside until every lane of the warp has one.
template <typename Memory>
__device__ void hide_fragments(const Memory& memory, const DrawTask& task, const Band& band) {
  WarpQueue queue(&memory.state->warps[warp_index()]);
  constexpr uint32_t kNone = Memory::kNone;
  const int count = memory.state->num_fragments;
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < count; first += kThreads) {
    const int fragment = first + lane_index();
    const bool has_one = fragment < count;
    const PixelCoverage coverage = has_one ? memory.coverage(fragment) : PixelCoverage{};
    uint32_t other = has_one ? static_cast<uint32_t>(memory.next[fragment]) : kNone;
    bool meets = has_one && full_of(memory, memory.pixel[fragment]) != kNone;
    uint32_t with = kNone;
    PICTURA_KEEP_LOOP
    for (;;) {
      queue.push(meets, static_cast<uint32_t>(fragment), with);
      const bool more = __any_sync(kAllLanes, other != kNone);
      PICTURA_KEEP_LOOP
      while (queue.is_ready() || (!more && first + kThreads >= count && !queue.is_empty())) {
        ask_pairs<Memory>(&task, queue.take(), band);
      }
      if (!more) break;
      with = other;
      meets = other != kNone && shared_samples(coverage, memory.coverage(static_cast<int>(other))) != 0;
      if (other != kNone) other = memory.next[other];
    }
  }
}

/// Hears of no fragment's weight.
struct NoVisit {
  static constexpr bool kWanted = false;
  __device__ void operator()(const ScreenFace&, float) const {}
};

// What a pixel's full face weighs: nothing hides it that is not one itself.
__device__ inline PixelSum::Weight weight_of_full() { return PixelSum::weight_of({1.0f, kAllSamples}, kAllSamples); }

template <typename Memory>
__device__ PixelSum::Weight weight_of_fragment(const Memory& memory, size_t fragment) {
  const int at = static_cast<int>(fragment);
  return PixelSum::weight_of(memory.coverage(at), memory.free(at));
}

template <typename Memory>
__device__ bool has_short_list(const Memory& memory, typename Memory::Word head) {
  int count = 0;
  PICTURA_KEEP_LOOP
  for (size_t i = head; i != Memory::kNone && count < kShortList; i = memory.next[i]) ++count;
  return count < kShortList;
}

// Weighs the fragments of a pixel with a short list: visit(face, weight) hears of each. Returns the pixel's colour.
template <typename Memory, typename Visit>
__device__ Rgb weigh_pixel(const Memory& memory, int pixel, const Visit& visit) {
  const typename Memory::Word word = memory.pixels[pixel];
  const auto full = full_of(memory, pixel), head = word & Memory::kNone;
  auto alone = [&](size_t face, float area) {
    visit(memory.faces[face], area);
    return memory.faces[face].color * area;
  };
  if (head == Memory::kNone) return full == Memory::kNone ? Rgb{} : alone(full, 1.0f);
  if (full == Memory::kNone && memory.next[head] == Memory::kNone) return alone(memory.face[head], memory.area[head]);

  const PixelSum::Weight of_full = weight_of_full();
  PixelSum sum;
  if (full != Memory::kNone) sum.add(of_full, memory.faces[full].color);
  PICTURA_KEEP_LOOP
  for (size_t i = head; i != Memory::kNone; i = memory.next[i]) {
    sum.add(weight_of_fragment(memory, i), memory.faces[memory.face[i]].color);
  }
  const PixelSum::Shares shares = sum.shares();
  if constexpr (Visit::kWanted) {
    if (full != Memory::kNone) visit(memory.faces[full], shares.of(of_full));
    PICTURA_KEEP_LOOP
    for (size_t i = head; i != Memory::kNone; i = memory.next[i]) {
      visit(memory.faces[memory.face[i]], shares.of(weight_of_fragment(memory, i)));
    }
  }
  return sum.color(shares);
}

// Weighs the fragments of a part and finishes its pixels. A short list is one thread's work; what longer ones weigh is
// summed by as many threads as there are fragments.
template <typename Memory, typename Visit, typename Finish>
__device__ void weigh_part(const Memory& memory, const Band& part, const Visit& visit, Finish&& finish) {
  using Word = typename Memory::Word;
  BlockState* state = memory.state;
  const int thread = static_cast<int>(threadIdx.x);
  const int columns = part.x_end - part.x_begin, pixels = (part.y_end - part.y_begin) * columns;
  PICTURA_KEEP_LOOP
  for (int p = thread; p < pixels; p += kThreads) {
    const int x = part.x_begin + p % columns, y = part.y_begin + p / columns, pixel = part.pixel(x, y);
    const Word word = memory.pixels[pixel], full = word & ~Memory::kNone;
    if (has_short_list(memory, word & Memory::kNone)) {
      finish(x, y, weigh_pixel(memory, pixel, visit));
      memory.pixels[pixel] = full | Memory::kNone;
    } else {
      const int at = atomicAdd(&state->num_sums, 1);
      memory.sums[at] = {{}, pixel};
      memory.pixels[pixel] = full | static_cast<Word>(at);
    }
  }
  __syncthreads();
  const int num_sums = state->num_sums;
  if (num_sums == 0) return;
  PICTURA_KEEP_LOOP
  for (int i = thread; i < state->num_fragments; i += kThreads) {
    const Word at = memory.pixels[memory.pixel[i]] & Memory::kNone;
    if (at == Memory::kNone) continue;
    const PixelSum::Weight weight = weight_of_fragment(memory, static_cast<size_t>(i));
    const PixelSum::Part add = PixelSum::part_of(weight, memory.faces[memory.face[i]].color);
    PixelSum::Part& part_of_sum = memory.sums[at].part[weight.kind];
    if (add.area != 0) atomicAdd(&part_of_sum.area, add.area);
    if (add.r != 0) atomicAdd(&part_of_sum.r, add.r);
    if (add.g != 0) atomicAdd(&part_of_sum.g, add.g);
    if (add.b != 0) atomicAdd(&part_of_sum.b, add.b);
  }
  __syncthreads();
  auto sum_of = [&](size_t at) {
    const SharedSum& shared = memory.sums[at];
    PixelSum sum;
    PICTURA_KEEP_LOOP
    for (int kind = 0; kind < PixelSum::kNumKinds; ++kind) {
      sum.add(static_cast<PixelSum::Kind>(kind), shared.part[kind]);
    }
    const Word full = full_of(memory, shared.pixel);
    if (full != Memory::kNone) sum.add(weight_of_full(), memory.faces[full].color);
    return sum;
  };
  PICTURA_KEEP_LOOP
  for (int at = thread; at < num_sums; at += kThreads) {
    const int pixel = memory.sums[at].pixel;
    const PixelSum sum = sum_of(static_cast<size_t>(at));
    const PixelSum::Shares shares = sum.shares();
    const Word full = full_of(memory, pixel);
    if (full != Memory::kNone) visit(memory.faces[full], shares.of(weight_of_full()));
    finish(part.x_of(pixel), part.y_of(pixel), sum.color(shares));
  }
  if constexpr (Visit::kWanted) {
    PICTURA_KEEP_LOOP
    for (int i = thread; i < state->num_fragments; i += kThreads) {
      const Word at = memory.pixels[memory.pixel[i]] & Memory::kNone;
      if (at == Memory::kNone) continue;
      visit(memory.faces[memory.face[i]], sum_of(at).shares().of(weight_of_fragment(memory, static_cast<size_t>(i))));
    }
  }
}

// Which part of a band comes next: as many rows as have room if every pixel that is covered partly holds a fragment,
// but at most `rows`; of a row that is too full, `columns` at most.
template <typename Memory>
__device__ Band next_part(const Memory& memory, const Band& band, int x, int y, int rows, int columns) {
  const int32_t* row_partial = memory.state->row_partial;
  int fragments = row_partial[y - band.y_begin], y_end = y + 1;
  if (x == 0 && columns == band.width) {
    if (fragments > memory.max_fragments) columns = max_of(1, band.width * memory.max_fragments / fragments);
    PICTURA_KEEP_LOOP
    while (columns == band.width && y_end < min_of(band.y_end, y + rows)) {
      fragments += row_partial[y_end - band.y_begin];
      if (fragments > memory.max_fragments) break;
      ++y_end;
    }
  }
  return {band.width, y, y_end, x, min_of(x + columns, band.width), (y - band.y_begin) * band.width};
}

// Draws the faces into rows [y_first, y_last), band by band and, within a band, in parts whose fragments have room.
// visit(face, weight) hears of each fragment, finish(x, y, color) of each pixel. False where one pixel alone has more
// fragments than there is room for. All threads of the block.
template <typename Memory, typename Visit, typename Finish>
__device__ bool draw_faces(const Memory& memory, const DrawTask& task, int num_faces, int width, int y_first,
                           int y_last, const Visit& visit, Finish&& finish) {
  BlockState* state = memory.state;
  const int thread = static_cast<int>(threadIdx.x);
  const int band_rows = min_of(memory.max_pixels / width, kMaxBandRows);
  PICTURA_KEEP_LOOP
  for (int row_0 = y_first; row_0 < y_last; row_0 += band_rows) {
    const Band band{width, row_0, min_of(row_0 + band_rows, y_last), 0, width, 0};
    const int band_pixels = (band.y_end - row_0) * width;
    PICTURA_KEEP_LOOP
    for (int p = thread; p < band_pixels; p += kThreads) memory.pixels[p] = 0;
    PICTURA_KEEP_LOOP
    for (int y = thread; y < band.y_end - row_0; y += kThreads) state->row_partial[y] = 0;
    if (thread == 0) state->next_batch = 0;
    __syncthreads();
    mark_full(memory, num_faces, band);
    __syncthreads();
    start_lists(memory, band_pixels);
    int x = 0, y = row_0, rows = band.y_end - row_0, columns = width;
    while (y < band.y_end) {
      if (thread == 0) state->num_fragments = state->num_sums = state->next_batch = 0;
      __syncthreads();
      const Band part = next_part(memory, band, x, y, rows, columns);
      make_fragments(memory, num_faces, part);
      __syncthreads();
      rows = part.y_end - part.y_begin;
      columns = part.x_end - part.x_begin;
      if (state->num_fragments > memory.max_fragments) {
        // What fills pixels but shows before others took the room.
        if (rows == 1 && columns == 1) return false;
        if (rows == 1) columns /= 2;
        rows = max_of(rows / 2, 1);
        PICTURA_KEEP_LOOP
        for (int p = thread; p < (part.y_end - part.y_begin) * width; p += kThreads) {
          memory.pixels[part.offset + p] |= Memory::kNone;
        }
        forget_listed(memory);
        __syncthreads();
        continue;
      }
      hide_fragments(memory, task, part);
      __syncthreads();
      weigh_part(memory, part, visit, finish);
      __syncthreads();
      x = part.x_end % width;
      if (x == 0) {
        y = part.y_end;
        rows = band.y_end - y;
        columns = width;
      }
    }
  }
  return true;
}

}  // namespace pictura::cuda
