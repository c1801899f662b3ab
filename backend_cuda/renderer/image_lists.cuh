// Allocation of images in the pool, and three lists of images: drawn from the pool, deferred until the pool is free,
// and left to the overflow launch.
#pragma once

#include "pictura/backend_cuda/renderer/face_setup.cuh"
#include "pictura/backend_cuda/renderer/rig.cuh"

namespace pictura::cuda {

__device__ inline int32_t view_of(const DrawTask& task, int32_t image) {
  return task.first_view + image / num_cameras(task);
}
__device__ inline int32_t camera_of(const DrawTask& task, int32_t image) { return image % num_cameras(task); }

// Returns how many of the launch's views are drawn: those with an index below *task.view_count. A count outside [0,
// max_views] is a fault.
__device__ inline int32_t num_drawn_views(const DrawTask& task) {
  if (task.view_count == nullptr) return task.num_views;
  const int32_t count = *task.view_count, drawn = clamp(count, 0, task.max_views);
  if (drawn != count && blockIdx.x == 0 && threadIdx.x == 0) record_fault(task, count, FaultKind::bad_view_count);
  return clamp(drawn - task.first_view, 0, task.num_views);
}

__device__ inline void mark_overflowed(const DrawTask& task, int32_t image) {
  task.overflow_images[atomicAdd(&task.counters->overflow, 1)] = image;
}

__device__ inline void defer(const DrawTask& task, int32_t image) {
  task.deferred_images[atomicAdd(&task.counters->deferred, 1)] = image;
}

__device__ inline int32_t* images_of_bucket(const DrawTask& task, int bucket) {
  return task.drawn_images + static_cast<int64_t>(bucket) * task.num_views * num_cameras(task);
}
__device__ inline void list_drawn(const DrawTask& task, int32_t image, int32_t listed) {
  const int bucket = min_of(listed / kFacesPerCostBucket, kNumCostBuckets - 1);
  images_of_bucket(task, bucket)[atomicAdd(&task.counters->cost_buckets[bucket], 1)] = image;
}
// Iterates over all buckets' images, the most expensive bucket first.
class DrawOrder {
 public:
  __device__ explicit DrawOrder(const DrawTask& task) : task_(task) {}
  /// Returns image number `turn`; -1 after the last image. `turn` must not decrease from call to call.
  __device__ int32_t image_of(int32_t turn) {
    const int32_t* cost_buckets = task_.counters->cost_buckets;
    PICTURA_NO_UNROLL
    for (; bucket_ >= 0; --bucket_) {
      const int32_t count = cost_buckets[bucket_];
      if (turn - begin_ < count) return images_of_bucket(task_, bucket_)[turn - begin_];
      begin_ += count;
    }
    return -1;
  }

 private:
  const DrawTask& task_;
  int bucket_ = kNumCostBuckets - 1;
  int32_t begin_ = 0;  // number of the bucket's first image
};

// Allocates the faces of an image with `listed` entries, and lists the image. Returns its first batch; -1 if the image
// was deferred or overflowed. Called by one thread.
__device__ inline int32_t allocate_faces(const DrawTask& task, int32_t image, int32_t listed) {
  BlockState* state = block_state();
  FaceSetupContext* context = &state->context;
  PreparedImage* out = task.pool.images + image;
  *out = {.face_count = kNotPrepared};
  if (listed > kMaxEntries) {
    mark_overflowed(task, image);
    return -1;
  }
  DrawCounters* counters = task.counters;
  const int32_t face_begin = atomicAdd(&counters->faces, listed);
  if (face_begin + listed > task.pool.max_faces) {
    defer(task, image);
    return -1;
  }
  const int32_t first_batch = atomicAdd(&counters->batches, FaceBatch::count_of(listed));
  list_drawn(task, image, listed);
  context->faces = task.pool.faces + face_begin;
  context->edges = task.pool.edges;
  context->num_faces = &out->face_count;
  context->num_clipped = &counters->clipped_edges;
  context->edge_begin = 4 * face_begin;
  context->clipped_begin = 4 * task.pool.max_faces;
  context->clipped_end = task.pool.max_edges;
  *out = image_of(*state, face_begin, 0);
  return first_batch;
}

__device__ inline uint32_t* entries_of(const SetupLists& lists, int32_t image) {
  return lists.entries + static_cast<int64_t>(image) * lists.max_entries;
}

}  // namespace pictura::cuda
