// Shared state of a block's threads, and warp collectives that balance uneven work. Warps synchronize only between
// phases.
#pragma once

#include "pictura/backend_cuda/renderer/kernel_arguments.h"

namespace pictura::cuda {

constexpr int kWarpSize = 32, kMaxWarps = 8;
constexpr unsigned kAllLanes = 0xFFFFFFFFu;

/// A view and its world's index ranges.
struct ViewState {
  View view;
  const DeviceGeometry* geometry;
  int32_t world_begin, world_end, light_begin, light_end;
};

/// A rectangle of an image, at most as wide as a tile, with row-major pixel indices.
struct Part {
  int x_begin, x_end, y_begin, y_end;
  __device__ int num_columns() const { return x_end - x_begin; }
  __device__ int num_rows() const { return y_end - y_begin; }
  __device__ int num_pixels() const { return num_rows() * kTileWidth_px; }
  __device__ int pixel(int x, int y) const { return (y - y_begin) * kTileWidth_px + (x - x_begin); }
  __device__ int x_of(int pixel) const {
    return x_begin + static_cast<int>(static_cast<unsigned>(pixel) % kTileWidth_px);
  }
  __device__ int y_of(int pixel) const {
    return y_begin + static_cast<int>(static_cast<unsigned>(pixel) / kTileWidth_px);
  }
};

/// Drawing order of a tile that does not fit into memory as a whole: vertical bands from left to right, each in parts
/// from top to bottom.
struct PartPlan {
  int band_begin, band_px;  // first column and width of the current band
  int wide_px, rows;        // maximum size of a part
  Part part;
};

struct WarpQueueStorage {
  uint32_t a[2 * kWarpSize], b[2 * kWarpSize];
};

struct WarpState {
  WarpQueueStorage queue;
  uint8_t owners[kWarpSize];
};

/// State of a block, always in shared memory.
struct BlockState {
  PreparedImage current;  // image being drawn
  PreparedImage upcoming;
  Scratch scratch;
  ScreenFace* faces;   // faces of the current image
  PolygonEdge* edges;  // edges of all images
  // Used during culling and face set-up:
  ViewState view;
  FaceSetupContext context;
  SetupCounts listed;
  int32_t num_entries, num_faces, num_clipped, overflow, usable;
  // Used during drawing:
  ImageEffect effect;
  int32_t num_rows, num_candidates, num_fragments, num_added, divides, num_composited, next_fragments, image;
  Part part, upcoming_part;
  PartPlan plan;
  WarpState warps[kMaxWarps];
};

__device__ inline int num_threads() { return static_cast<int>(blockDim.x); }
__device__ inline int num_warps() { return num_threads() / kWarpSize; }
__device__ inline int lane_index() { return static_cast<int>(threadIdx.x) % kWarpSize; }
__device__ inline int warp_index() { return static_cast<int>(threadIdx.x) / kWarpSize; }
__device__ inline unsigned lanes_below() { return (1u << lane_index()) - 1; }

// Without __syncwarp(), a diverged warp would arrive at the barrier twice.
__device__ inline void sync_block() {
  __syncwarp();
  __syncthreads();
}

// Fetches and increments a counter, once per warp.
__device__ inline int warp_next(int32_t* counter) {
  int next = 0;
  if (lane_index() == 0) next = atomicAdd(counter, 1);
  return __shfl_sync(kAllLanes, next, 0);
}

// Records a fault, unless an earlier fault is pending.
__device__ inline void record_fault(const DrawTask& task, int32_t index, FaultKind kind) {
  atomicCAS(task.fault, kNoFault, word_of({kind, index}));
}

// Returns false and records a fault if the view is invalid.
__device__ inline bool set_view(ViewState* state, const DrawTask& task, int32_t view_index) {
  auto fault = [&](FaultKind kind) {
    record_fault(task, view_index, kind);
    return false;
  };
  state->view = task.views[view_index];
  const View& view = state->view;
  if (view.world < 0 || static_cast<size_t>(view.world) + 1 >= task.scene.world_begin.size()) {
    return fault(FaultKind::bad_world);
  }
  const GeometryHandle handle = task.scene.geometry[view.world];
  if (handle < 0 || handle >= task.num_geometries) return fault(FaultKind::bad_geometry);
  if (!has_finite_pose(view) || !has_valid_hidden_range(view, task.scene.hidden_agents.size()))
    return fault(FaultKind::bad_pose);
  const size_t world = static_cast<size_t>(view.world);
  state->geometry = task.geometries + handle;
  state->world_begin = task.scene.world_begin[world];
  state->world_end = task.scene.world_begin[world + 1];
  state->light_begin = task.scene.light_begin[world];
  state->light_end = task.scene.light_begin[world + 1];
  if (state->world_end - state->world_begin > kMaxBoxesPerWorld) return fault(FaultKind::too_many_agents);
  if (!state->geometry->is_held()) return fault(FaultKind::bad_geometry);
  if (!has_enough_lights(state->light_end - state->light_begin, state->geometry->pieces.num_signals)) {
    return fault(FaultKind::too_few_lights);
  }
  return true;
}

__device__ inline int warp_inclusive_sum(int value) {
  for (int step = 1; step < kWarpSize; step *= 2) {
    const int other = __shfl_up_sync(kAllLanes, value, step);
    if (lane_index() >= step) value += other;
  }
  return value;
}

// Allocates a warp's indices with one atomic addition, and returns the first index. end: inclusive prefix sum of the
// lanes' counts.
__device__ inline int32_t warp_allocate(int32_t* counter, int end) {
  int32_t first = 0;
  if (lane_index() == kWarpSize - 1) first = atomicAdd(counter, end);
  return __shfl_sync(kAllLanes, first, kWarpSize - 1);
}
// Allocates one index for each lane where `wanted` is true.
__device__ inline int32_t warp_allocate_one(int32_t* counter, bool wanted) {
  const unsigned wanting = __ballot_sync(kAllLanes, wanted);
  int32_t first = 0;
  if (lane_index() == 0 && wanting != 0) first = atomicAdd(counter, __popc(wanting));
  return __shfl_sync(kAllLanes, first, 0) + __popc(wanting & lanes_below());
}

// Finds the lane that owns item `first + lane_index()`, and returns its rank among the lanes with items. Items are
// numbered consecutively over all lanes; the calling lane's items start at `begin`.
__device__ inline int owner_rank(int first, int begin, bool has_some) {
  const bool starts_here = has_some && begin >= first && begin < first + kWarpSize;
  const unsigned starts = __reduce_or_sync(kAllLanes, starts_here ? 1u << (begin - first) : 0u);
  const int before = __popc(__ballot_sync(kAllLanes, has_some && begin < first));
  return before + __popc(starts & (lanes_below() << 1 | 1u)) - 1;
}

// Balances load: each lane has `count` items, and all lanes together call visit(item, owner, k) for 32 items at a time.
// end: inclusive prefix sum of the counts. item: index among the warp's items. owner: lane that owns the item; -1 past
// the last item. k: index among the owner's items.
template <typename Visit>
__device__ inline void warp_expand(WarpState* warp, int count, int end, Visit&& visit) {
  const int lane = lane_index(), begin = end - count;
  const int total = __shfl_sync(kAllLanes, end, kWarpSize - 1);
  const unsigned owning = __ballot_sync(kAllLanes, count > 0);
  if (count > 0) warp->owners[__popc(owning & lanes_below())] = static_cast<uint8_t>(lane);
  __syncwarp();
  const int owner_of_rank = warp->owners[lane];
  __syncwarp();
  PICTURA_NO_UNROLL
  for (int item = 0; item < total; item += kWarpSize) {
    const int owner = __shfl_sync(kAllLanes, owner_of_rank, owner_rank(item, begin, count > 0)) % kWarpSize;
    const int k = item + lane - __shfl_sync(kAllLanes, begin, owner);
    visit(item + lane, item + lane < total ? owner : -1, k);
  }
}

// Returns the number of passes that process a list. Each pass is made by one warp, with at most one entry per lane. In
// each pass, a lane takes entry lane * passes + pass: neighbouring entries, which tend to be equally expensive, are in
// different passes.
template <int kThreads>
__device__ inline int passes_of(int count) {
  const unsigned rounds = static_cast<unsigned>(count + kThreads - 1) / kThreads;
  return static_cast<int>(rounds) * (kThreads / kWarpSize);
}

// Queue that compacts a warp's work. If is_ready(), take() returns one pair to every lane. At the end, some lanes may
// get no pair.
class WarpQueue {
 public:
  __device__ explicit WarpQueue(WarpQueueStorage* storage) : storage_(storage) {}
  __device__ void push(bool wanted, uint32_t a, uint32_t b) {
    const unsigned pushing = __ballot_sync(kAllLanes, wanted);
    if (wanted) {
      const int index = count_ + __popc(pushing & lanes_below());
      storage_->a[index] = a;
      storage_->b[index] = b;
    }
    count_ += __popc(pushing);
  }
  __device__ bool is_ready() const { return count_ >= kWarpSize; }
  __device__ bool is_empty() const { return count_ == 0; }
  struct Pair {
    bool is_valid;
    uint32_t a, b;
  };
  __device__ Pair take() {
    __syncwarp();
    const int first = max_of(count_ - kWarpSize, 0), index = first + lane_index();
    Pair pair{index < count_, 0, 0};
    if (pair.is_valid) {
      pair.a = storage_->a[index];
      pair.b = storage_->b[index];
    }
    count_ = first;
    __syncwarp();
    return pair;
  }

 private:
  WarpQueueStorage* storage_;
  int count_ = 0;
};

// Sums over the block's threads. of_thread: memory of one element per thread. Collective over the block.
__device__ inline int64_t block_sum(int64_t* of_thread, int64_t value) {
  sync_block();
  of_thread[threadIdx.x] = value;
  sync_block();
  int64_t sum = 0;
  PICTURA_NO_UNROLL
  for (int i = 0; i < num_threads(); ++i) sum += of_thread[i];
  return sum;
}

}  // namespace pictura::cuda
