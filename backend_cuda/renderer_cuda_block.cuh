// What the threads of a block share while they draw an image: what the view shows, and the ways in which the lanes of a
// warp share out uneven work. Warps work on their own; the block waits only between phases.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_kernel.h"

namespace pictura::cuda {

constexpr int kThreads = 128, kWarpSize = 32, kWarps = kThreads / kWarpSize;
constexpr unsigned kAllLanes = 0xFFFFFFFFu;
/// Rows of an image that are drawn at once, at most.
constexpr int kMaxBandRows = 256;

/// What a view shows.
struct ViewState {
  View view;
  const DeviceGeometry* geometry;
  int32_t world_begin, world_end, light_begin, light_end;
};

/// A row of a face: which pixels it touches, and which of those it covers fully.
struct RowJob {
  int32_t face;
  uint16_t slot;  // of the face, among those that the warp works on
  uint16_t y, begin, end, full_begin, full_end;
};

/// What the fragments of one pixel weigh, summed by many threads.
struct SharedSum {
  PixelSum::Part part[PixelSum::kNumKinds];
  int32_t pixel;
};

/// Edges of a face that a warp keeps at hand; most faces have no more.
constexpr int kNearEdges = 4;

/// What a warp keeps for its lanes to read of each other.
struct WarpState {
  PolygonEdge edges[kWarpSize][kNearEdges];  // of the faces that it works on
  int32_t edge_begin[kWarpSize], edge_count[kWarpSize];
  RowJob jobs[kWarpSize];
  uint32_t queue_a[2 * kWarpSize], queue_b[2 * kWarpSize];
  uint8_t owners[kWarpSize];
};

/// A pixel with fewer fragments besides its full face is one thread's.
constexpr int kShortList = 3;
__host__ __device__ constexpr int most_sums(int max_fragments) { return max_fragments / kShortList; }

/// Faces that the mark of a pixel's nearest full face can tell apart in 32 bits.
constexpr int kMarkedFaceBits = 11, kMostMarkedFaces = (1 << kMarkedFaceBits) - 1;

/// In shared memory, whatever the block's other memory is.
struct BlockState {
  Scratch scratch;  // this block's
  ViewState view;
  ImageSetting setting;
  int32_t num_visible, num_quads, num_lights, num_faces, num_edges, num_fragments, num_sums, next_batch, overflow,
      usable, image;
  int32_t row_partial[kMaxBandRows];  // pixels of each row that faces cover partly
  WarpState warps[kWarps];
};

__device__ inline int lane_index() { return static_cast<int>(threadIdx.x) % kWarpSize; }
__device__ inline int warp_index() { return static_cast<int>(threadIdx.x) / kWarpSize; }
__device__ inline unsigned lanes_below() { return (1u << lane_index()) - 1; }

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

// Sum of the values of the lanes up to this one.
__device__ inline int sum_up_to(int value) {
  for (int step = 1; step < kWarpSize; step *= 2) {
    const int other = __shfl_up_sync(kAllLanes, value, step);
    if (lane_index() >= step) value += other;
  }
  return value;
}

// Adds what the lanes of a warp want to a counter; each gets its place.
__device__ inline int32_t take_places(int32_t* counter, int count) {
  const int end = sum_up_to(count);
  int32_t first = 0;
  if (lane_index() == kWarpSize - 1) first = atomicAdd(counter, end);
  return __shfl_sync(kAllLanes, first, kWarpSize - 1) + end - count;
}
// ... of those that want one.
__device__ inline int32_t take_place(int32_t* counter, bool wanted) {
  const unsigned wanting = __ballot_sync(kAllLanes, wanted);
  int32_t first = 0;
  if (lane_index() == 0 && wanting != 0) first = atomicAdd(counter, __popc(wanting));
  return __shfl_sync(kAllLanes, first, 0) + __popc(wanting & lanes_below());
}

// Shares out what the lanes of a warp bring, `count` items each: visit(owner, k) is called by all lanes, for 32 items
// at a time, with the lane whose item it is (-1: none is left) and the item's number among that lane's. The items from
// `first` on, 32 of every `stride`.
template <typename Visit>
__device__ inline void share_out(WarpState* warp, int count, Visit&& visit, int first = 0, int stride = kWarpSize) {
  const int lane = lane_index();
  const int end = sum_up_to(count), begin = end - count;
  const int total = __shfl_sync(kAllLanes, end, kWarpSize - 1);
  // Those that have items, without gaps.
  const unsigned owning = __ballot_sync(kAllLanes, count > 0);
  if (count > 0) warp->owners[__popc(owning & lanes_below())] = static_cast<uint8_t>(lane);
  __syncwarp();
  const int owner_of_rank = warp->owners[lane];
  __syncwarp();
  PICTURA_KEEP_LOOP
  for (int item = first; item < total; item += stride) {
    const bool starts_here = count > 0 && begin >= item && begin < item + kWarpSize;
    const unsigned starts = __reduce_or_sync(kAllLanes, starts_here ? 1u << (begin - item) : 0u);
    const int before = __popc(__ballot_sync(kAllLanes, count > 0 && begin < item));
    const int rank = before + __popc(starts & (lanes_below() << 1 | 1u)) - 1;
    const int owner = __shfl_sync(kAllLanes, owner_of_rank, rank) % kWarpSize;
    const int k = item + lane - __shfl_sync(kAllLanes, begin, owner);
    visit(item + lane < total ? owner : -1, k);
  }
}

// Pairs of numbers that the lanes of a warp put aside until there are enough for every lane to take one: each lane may
// push a pair; while is_ready(), take() gives a pair to each lane, or to as many as there are left.
class WarpQueue {
 public:
  __device__ explicit WarpQueue(WarpState* warp) : warp_(warp) {}
  __device__ void push(bool wanted, uint32_t a, uint32_t b) {
    const unsigned pushing = __ballot_sync(kAllLanes, wanted);
    if (wanted) {
      const int place = count_ + __popc(pushing & lanes_below());
      warp_->queue_a[place] = a;
      warp_->queue_b[place] = b;
    }
    count_ += __popc(pushing);
  }
  __device__ bool is_ready() const { return count_ >= kWarpSize; }
  __device__ bool is_empty() const { return count_ == 0; }
  struct Pair {
    bool is_one;
    uint32_t a, b;
  };
  __device__ Pair take() {
    __syncwarp();
    const int first = max_of(count_ - kWarpSize, 0), place = first + lane_index();
    Pair pair{place < count_, 0, 0};
    if (pair.is_one) {
      pair.a = warp_->queue_a[place];
      pair.b = warp_->queue_b[place];
    }
    count_ = first;
    __syncwarp();
    return pair;
  }

 private:
  WarpState* warp_;
  int count_ = 0;
};

// Sum over the threads, in their order. All threads of the block.
__device__ inline double block_sum(double value) {
  __shared__ double of_thread[kThreads];
  __syncthreads();
  of_thread[threadIdx.x] = value;
  __syncthreads();
  double sum = 0;
  PICTURA_KEEP_LOOP
  for (int i = 0; i < kThreads; ++i) sum += of_thread[i];
  return sum;
}

}  // namespace pictura::cuda
