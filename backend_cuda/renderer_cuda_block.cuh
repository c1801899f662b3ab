// What the threads of a block share while they draw an image: what the view shows, the block's memory, and the sums and
// searches by which they share out work.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_kernel.h"

namespace pictura::cuda {

constexpr int kThreads = 256, kWarpSize = 32, kWarps = kThreads / kWarpSize;
constexpr int kMaxBandRows = 256;

/// What a view shows.
struct ViewState {
  View view;
  const DeviceGeometry* geometry;
  int32_t world_begin, world_end, light_begin, light_end;
};

/// What a face covers of one pixel, linked to the pixel's other fragments.
template <typename Index>
struct StoredFragment {
  float area, nearness;
  uint32_t samples_low, samples_high;
  Index next, face;
};

/// A row of a face: which pixels it touches, and which of those it covers fully.
struct RowJob {
  int32_t face;
  uint16_t y, begin, end, full_begin, full_end;
};

/// In shared memory, whatever the block's other memory is.
struct BlockState {
  ViewState view;
  ImageSetting setting;
  int32_t num_visible, num_edges, num_fragments, overflow, usable, image, part_end;
  int32_t warp_sums[kWarps];
  double thread_sums[kThreads];
  RowJob jobs[kThreads];
  uint32_t firsts[kThreads + 1];
  int32_t row_fragments[kMaxBandRows];
};

/// A block's memory. Index: of faces and fragments, 16 bits where they suffice. Word: two of them.
template <typename Index_, typename Word_>
struct BlockMemory {
  using Index = Index_;
  using Word = Word_;
  static constexpr int kHalf = 4 * sizeof(Word);
  /// Of the lower half of a word: no face, the end of a list.
  static constexpr Word kNone = (Word{1} << kHalf) - 1;

  BlockState* state;
  ScreenFace* faces;
  PolygonEdge* edges;
  // While things are gathered.
  uint32_t* seen;     // [max_pieces / 32] a bit for each strip or wall of the map
  uint32_t* visible;  // [max_faces]
  // While fragments are made.
  uint32_t* first_job;  // [max_faces + 1] of each face
  Word* pixels;         // [max_pixels] of a band
  StoredFragment<Index>* fragments;
  int32_t max_faces, max_edges, max_pieces, max_pixels, max_fragments;
};

__device__ inline bool is_finite(float value) { return fabsf(value) <= 3.4e38f; }

// The first fault stands until the host has thrown it.
__device__ inline void note_fault(const DrawTask& task, int32_t view, FaultKind kind) {
  if (atomicCAS(&task.fault->view, -1, view) == -1) task.fault->kind = kind;
}

// Sets what a view shows; false, with a fault noted, where it names something that does not exist.
__device__ inline bool set_view(ViewState* state, const DrawTask& task, int32_t view_index) {
  auto fault = [&](FaultKind kind) {
    note_fault(task, view_index, kind);
    return false;
  };
  state->view = task.views[view_index];
  const View& view = state->view;
  if (view.world < 0 || static_cast<size_t>(view.world) + 1 >= task.scene.world_begin.size()) return fault(kBadWorld);
  const GeometryHandle handle = task.scene.geometry[static_cast<size_t>(view.world)];
  if (handle < 0 || handle >= task.num_geometries) return fault(kBadGeometry);
  const float direction = view.cos_heading * view.cos_heading + view.sin_heading * view.sin_heading;
  if (!is_finite(view.origin_m.x) || !is_finite(view.origin_m.y) || !is_finite(view.origin_m.z) ||
      !(fabsf(direction - 1.0f) < 1e-2f) || !(view.body_length_m >= 0.0f) || view.hidden_begin < 0 ||
      static_cast<size_t>(max_of(view.hidden_end, 0)) > task.scene.hidden_agents.size()) {
    return fault(kBadPose);
  }
  const size_t world = static_cast<size_t>(view.world);
  state->geometry = task.geometries + handle;
  state->world_begin = task.scene.world_begin[world];
  state->world_end = task.scene.world_begin[world + 1];
  state->light_begin = task.scene.light_begin[world];
  state->light_end = task.scene.light_begin[world + 1];
  if (state->world_end - state->world_begin > task.max_world_agents) return fault(kTooManyAgents);
  return true;
}

// Sum of the values of the threads before this one; the sum of all in *total_out. All threads of the block.
__device__ inline int32_t sum_before(BlockState* state, int32_t value, int32_t* total_out) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpSize, warp = static_cast<int>(threadIdx.x) / kWarpSize;
  int32_t sum = value;
  for (int step = 1; step < kWarpSize; step *= 2) {
    const int32_t other = __shfl_up_sync(0xFFFFFFFFu, sum, step);
    if (lane >= step) sum += other;
  }
  __syncthreads();
  if (lane == kWarpSize - 1) state->warp_sums[warp] = sum;
  __syncthreads();
  int32_t before = 0, total = 0;
  for (int w = 0; w < kWarps; ++w) {
    if (w < warp) before += state->warp_sums[w];
    total += state->warp_sums[w];
  }
  *total_out = total;
  return before + sum - value;
}

// Sum over the threads, in their order. All threads of the block.
__device__ inline double block_sum(BlockState* state, double value) {
  __syncthreads();
  state->thread_sums[threadIdx.x] = value;
  __syncthreads();
  double sum = 0;
  for (int i = 0; i < kThreads; ++i) sum += state->thread_sums[i];
  return sum;
}

// The last of `count` ascending firsts that is at most `item`.
__device__ inline int find_owner(const uint32_t* firsts, int count, uint32_t item) {
  int low = 0, high = count;
  while (high - low > 1) {
    const int middle = (low + high) >> 1;
    if (firsts[middle] <= item) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

}  // namespace pictura::cuda
