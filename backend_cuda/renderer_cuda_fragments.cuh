// From the faces of an image to its pixels: threads share out rows of faces, then the pixels that those touch, then
// pixels. What a face covers of a pixel is a fragment; each pixel has a list of them, and the nearest face that covers
// it fully, behind which nothing can be seen.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_block.cuh"

namespace pictura::cuda {

// Shares out the rows [y_begin, y_end) of the faces; returns their number. All threads of the block.
template <typename Memory>
__device__ uint32_t count_jobs(const Memory& memory, int num_faces, int y_begin, int y_end) {
  uint32_t jobs = 0;
  for (int first = 0; first < num_faces; first += kThreads) {
    const int i = first + static_cast<int>(threadIdx.x);
    int rows = 0;
    if (i < num_faces) {
      const PixelBox box = memory.faces[i].box;
      rows = max_of(0, min_of(box.y_end, y_end) - max_of(box.y_begin, y_begin));
    }
    int32_t total = 0;
    const int32_t before = sum_before(memory.state, rows, &total);
    if (i < num_faces) memory.first_job[i] = jobs + static_cast<uint32_t>(before);
    jobs += static_cast<uint32_t>(total);
  }
  if (threadIdx.x == 0) memory.first_job[num_faces] = jobs;
  __syncthreads();
  return jobs;
}

template <typename Memory>
__device__ RowJob make_job(const Memory& memory, int num_faces, uint32_t job, int y_begin) {
  const int i = find_owner(memory.first_job, num_faces, job);
  const ScreenFace& face = memory.faces[i];
  const int y = max_of(face.box.y_begin, y_begin) + static_cast<int>(job - memory.first_job[i]);
  const RowSpan span = row_span(memory.edges + face.edge_begin, face.edge_count, face.box, y);
  return {i,
          static_cast<uint16_t>(y),
          static_cast<uint16_t>(span.begin),
          static_cast<uint16_t>(span.end),
          static_cast<uint16_t>(span.full_begin),
          static_cast<uint16_t>(span.full_end)};
}

// A pixel's word while the nearest full faces are found: the larger is the nearer; 0 for none. The bits of a nearness
// sort like the nearness; those that have no room are left off.
template <typename Memory>
__device__ typename Memory::Word full_mark(float nearness, int face) {
  constexpr int kBits = 8 * sizeof(typename Memory::Word), kFaceBits = kBits == 32 ? 11 : 32;
  return static_cast<typename Memory::Word>(__float_as_uint(nearness) >> (kBits == 32 ? 11 : 0)) << kFaceBits |
         static_cast<typename Memory::Word>(face + 1);
}
template <typename Memory>
__device__ int marked_face(typename Memory::Word mark) {
  constexpr int kFaceBits = sizeof(typename Memory::Word) == 4 ? 11 : 32;
  return static_cast<int>(mark & ((typename Memory::Word{1} << kFaceBits) - 1)) - 1;
}
constexpr int kMostMarkedFaces = (1 << 11) - 1;

// Marks, in rows [y_begin, y_end), the nearest face that covers each pixel fully, and counts the pixels of each row
// that faces touch.
template <typename Memory>
__device__ void mark_full(const Memory& memory, int num_faces, int width, int y_begin, uint32_t jobs) {
  for (uint32_t j = threadIdx.x; j < jobs; j += kThreads) {
    const RowJob job = make_job(memory, num_faces, j, y_begin);
    const ScreenFace& face = memory.faces[job.face];
    typename Memory::Word* row = memory.pixels + (job.y - y_begin) * width;
    for (int x = job.full_begin; x < job.full_end; ++x) {
      const auto mark = full_mark<Memory>(middle_nearness(face, x, job.y), job.face);
      if (row[x] < mark) atomicMax(&row[x], mark);
    }
    atomicAdd(&memory.state->row_fragments[job.y - y_begin], job.end - job.begin);
  }
}

// Turns the marks of a band into what pixels hold from then on: in the upper half the full face (kNone: none), in the
// lower half the head of the list of fragments.
template <typename Memory>
__device__ void start_lists(const Memory& memory, int count) {
  using Word = typename Memory::Word;
  for (int p = static_cast<int>(threadIdx.x); p < count; p += kThreads) {
    const int face = marked_face<Memory>(memory.pixels[p]);
    const Word full = face < 0 ? Memory::kNone : static_cast<Word>(face);
    memory.pixels[p] = full << Memory::kHalf | Memory::kNone;
  }
}

// Computes what faces cover of the pixels of rows [y_begin, y_end), and links it to the pixels. row_0 is the row of the
// first pixel in the block's memory.
template <typename Memory>
__device__ void make_fragments(const Memory& memory, int num_faces, int width, int row_0, int y_begin, uint32_t jobs) {
  using Word = typename Memory::Word;
  using Index = typename Memory::Index;
  BlockState* state = memory.state;
  const int thread = static_cast<int>(threadIdx.x);
  for (uint32_t first = 0; first < jobs; first += kThreads) {
    RowJob job{};
    if (first + threadIdx.x < jobs) job = make_job(memory, num_faces, first + threadIdx.x, y_begin);
    int32_t total = 0;
    const int32_t before = sum_before(state, job.end - job.begin, &total);
    state->jobs[thread] = job;
    state->firsts[thread] = static_cast<uint32_t>(before);
    __syncthreads();
    for (int32_t k = thread; k < total; k += kThreads) {
      const int owner = find_owner(state->firsts, kThreads, static_cast<uint32_t>(k));
      const RowJob row = state->jobs[owner];
      const int x = row.begin + k - static_cast<int>(state->firsts[owner]);
      const bool is_full = x >= row.full_begin && x < row.full_end;
      Word* pixel = memory.pixels + (row.y - row_0) * width + x;
      const Word full = *pixel >> Memory::kHalf;
      if (is_full && full == static_cast<Word>(row.face)) continue;
      const ScreenFace& face = memory.faces[row.face];
      if (full != Memory::kNone && !may_show_before(face, memory.faces[full], x, row.y, is_full)) continue;
      const PixelCoverage coverage = is_full
                                         ? PixelCoverage{1.0f, kAllSamples}
                                         : pixel_coverage(memory.edges + face.edge_begin, face.edge_count, x, row.y);
      if (coverage.area <= 0.0f) continue;
      const Fragment fragment = make_fragment(face, row.face, coverage, x, row.y);
      const auto slot = static_cast<Word>(atomicAdd(&state->num_fragments, 1));
      const Word head = atomicExch(pixel, full << Memory::kHalf | slot) & Memory::kNone;
      memory.fragments[slot] = {coverage.area,
                                fragment.nearness,
                                static_cast<uint32_t>(coverage.samples),
                                static_cast<uint32_t>(coverage.samples >> 32),
                                static_cast<Index>(head),
                                static_cast<Index>(row.face)};
    }
    __syncthreads();
  }
}

// A pixel's fragments: the full face, then the stored ones.
template <typename Memory>
class PixelList {
 public:
  static constexpr int kEnd = -1;
  __device__ PixelList(const Memory& memory, typename Memory::Word word, int x, int y)
      : memory_(memory), head_(place_of(word & Memory::kNone)) {
    const typename Memory::Word full = word >> Memory::kHalf;
    has_full_ = full != Memory::kNone;
    if (!has_full_) return;
    const int face = static_cast<int>(full);
    full_ = {{1.0f, kAllSamples}, middle_nearness(memory.faces[face], x, y), face};
  }
  __device__ int begin() const { return has_full_ ? kFull : head_; }
  __device__ int next(int place) const { return place == kFull ? head_ : place_of(memory_.fragments[place].next); }
  __device__ Fragment at(int place) const {
    if (place == kFull) return full_;
    const auto& stored = memory_.fragments[place];
    const uint64_t samples = static_cast<uint64_t>(stored.samples_high) << 32 | stored.samples_low;
    return {{stored.area, samples}, stored.nearness, static_cast<int32_t>(stored.face)};
  }

 private:
  static constexpr int kFull = -2;
  __device__ static int place_of(typename Memory::Word slot) {
    return slot == Memory::kNone ? kEnd : static_cast<int>(slot);
  }
  const Memory& memory_;
  Fragment full_;
  int head_;
  bool has_full_;
};

// Whether, in the image that the block draws, a solid stands on a strip.
template <typename Memory>
__device__ bool stands(const Memory& memory, const DrawTask& task, uint32_t solid, uint32_t strip) {
  const ViewState& view = memory.state->view;
  const StaticGeometryView& pieces = view.geometry->raster.pieces;
  return stands_on(extent_of(solid, pieces, task.scene, view.world_begin),
                   extent_of(strip, pieces, task.scene, view.world_begin), memory.state->setting.camera.position_m);
}

// Weighs the fragments of a pixel: visit(fragment, weight) hears of each. Returns the pixel's colour.
template <typename Memory, typename Visit>
__device__ Rgb weigh_pixel(const Memory& memory, const DrawTask& task, const PixelList<Memory>& list, int x, int y,
                           Visit&& visit) {
  constexpr int kEnd = PixelList<Memory>::kEnd;
  const int first = list.begin();
  if (first == kEnd) return {};
  if (list.next(first) == kEnd) {
    const Fragment alone = list.at(first);
    visit(alone, alone.coverage.area);
    return memory.faces[alone.face].color * alone.coverage.area;
  }
  const Vec2 corner{static_cast<float>(x), static_cast<float>(y)};
  auto weight_at = [&](int place) {
    const Fragment fragment = list.at(place);
    uint64_t free = reach_of(fragment.coverage);
    for (int other = first; other != kEnd; other = list.next(other)) {
      if (other == place) continue;
      const Fragment of_other = list.at(other);
      free &= ~hide_each_other(fragment.coverage, of_other.coverage, memory.faces[fragment.face],
                               memory.faces[of_other.face], corner,
                               [&](uint32_t solid, uint32_t strip) { return stands(memory, task, solid, strip); })
                   .of_a;
    }
    return PixelSum::weight_of(fragment.coverage, free);
  };
  PixelSum sum;
  for (int place = first; place != kEnd; place = list.next(place)) {
    sum.add(weight_at(place), memory.faces[list.at(place).face].color);
  }
  const PixelSum::Shares shares = sum.shares();
  for (int place = first; place != kEnd; place = list.next(place)) {
    visit(list.at(place), shares.of(weight_at(place)));
  }
  return sum.color(shares);
}

// Draws the faces into rows [y_first, y_last), band by band and, within a band, in parts whose fragments have room.
// visit(fragment, weight) hears of each, finish(x, y, color) of each pixel. False where one row alone has more
// fragments than there is room for. All threads of the block.
template <typename Memory, typename Visit, typename Finish>
__device__ bool draw_faces(const Memory& memory, const DrawTask& task, int num_faces, int width, int y_first,
                           int y_last, Visit&& visit, Finish&& finish) {
  BlockState* state = memory.state;
  const int thread = static_cast<int>(threadIdx.x);
  const int band_rows = min_of(memory.max_pixels / width, kMaxBandRows);
  for (int row_0 = y_first; row_0 < y_last; row_0 += band_rows) {
    const int row_end = min_of(row_0 + band_rows, y_last);
    for (int p = thread; p < (row_end - row_0) * width; p += kThreads) memory.pixels[p] = 0;
    for (int y = thread; y < row_end - row_0; y += kThreads) state->row_fragments[y] = 0;
    uint32_t jobs = count_jobs(memory, num_faces, row_0, row_end);
    mark_full(memory, num_faces, width, row_0, jobs);
    __syncthreads();
    start_lists(memory, (row_end - row_0) * width);
    for (int y_begin = row_0; y_begin < row_end;) {
      if (thread == 0) {
        int fragments = 0, y = y_begin;
        while (y < row_end && fragments + state->row_fragments[y - row_0] <= memory.max_fragments) {
          fragments += state->row_fragments[y - row_0];
          ++y;
        }
        state->part_end = y;
        state->num_fragments = 0;
      }
      __syncthreads();
      const int y_end = state->part_end;
      if (y_end == y_begin) return false;
      if (y_begin != row_0 || y_end != row_end) jobs = count_jobs(memory, num_faces, y_begin, y_end);
      make_fragments(memory, num_faces, width, row_0, y_begin, jobs);
      for (int p = thread; p < (y_end - y_begin) * width; p += kThreads) {
        const int x = p % width, y = y_begin + p / width;
        PixelList<Memory> list(memory, memory.pixels[(y_begin - row_0) * width + p], x, y);
        finish(x, y, weigh_pixel(memory, task, list, x, y, visit));
      }
      __syncthreads();
      y_begin = y_end;
    }
  }
  return true;
}

}  // namespace pictura::cuda
