// The drawing kernels. They are compiled ahead of time (in launch.cu) and at run time (by NVRTC).
#pragma once

#include "pictura/backend_cuda/renderer/face_setup.cuh"
#include "pictura/backend_cuda/renderer/image_lists.cuh"
#include "pictura/backend_cuda/renderer/image_writer.cuh"
#include "pictura/backend_cuda/renderer/pixels.cuh"
#include "pictura/backend_cuda/renderer/planes.cuh"
#include "pictura/backend_cuda/renderer/visibility.cuh"
#include "pictura/common/portable/async_copy.h"

namespace pictura::cuda {

// Returns false if the part does not fit into the block's memory.
template <typename Memory>
__device__ bool draw_image_part(const Memory& memory, const DrawTask& task, int32_t view, int32_t camera,
                                const Part& part) {
  const CameraSlot& slot = task.cameras[camera];
  const int width = width_px(slot.camera), height = height_px(slot.camera);
  const int num_faces = memory.state->current.face_count;
  const int64_t plane = static_cast<int64_t>(width) * height;
  if (kRandomizesCameras && threadIdx.x == 0) {
    // Images of invalid views are black.
    const bool is_valid = memory.state->current.geometry != nullptr;
    memory.state->effect = is_valid ? image_effect(task.randomization, task.views[view].key, camera) : ImageEffect{};
  }
  const ImageWriter writer{task.format, task.order, slot.color, view * slot.view_stride,
                           plane,       width,      height,     task.patch_px};
  if (!draw_faces(memory, num_faces, part, NoVisit{}, writer)) return false;
  if (task.wants_planes) draw_planes<Memory>(PlaneWriter{slot.planes, width, view * plane}, num_faces, part);
  return true;
}

// Lists the primitives that may be visible in each image, and allocates its faces.
extern "C" __global__ void __launch_bounds__(kSetupThreads, kCullBlocksPerProcessor)
    pictura_cull(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  BlockState* state = block_state();
  CullShared* storage = &geometry_shared()->cull;
  DrawCounters* counters = task.counters;
  const int32_t num_images = num_drawn_views(task) * num_cameras(task), num_blocks = static_cast<int32_t>(gridDim.x);
  PICTURA_NO_UNROLL
  for (auto image = static_cast<int32_t>(blockIdx.x); image < num_images;
       image = num_blocks + warp_next(&counters->next_culled)) {
    const int32_t camera = camera_of(task, image);
    if (lane_index() == 0) {
      state->num_entries = 0;
      state->usable = set_image(state, task, view_of(task, image), camera) ? 1 : 0;
    }
    __syncwarp();
    if (state->usable == 0) {
      if (lane_index() == 0) {
        task.pool.images[image] = {};  // black
        list_drawn(task, image, 0);
      }
      continue;
    }
    EntryList list(entries_of(task.pool.lists, image), task.pool.lists.max_entries, &state->num_entries);
    cull(state, task, storage, &list);
    __syncwarp();
    list.finish();
    const int32_t listed = state->num_entries;
    find_occluders(&state->context, entries_of(task.pool.lists, image), min_of(listed, task.pool.lists.max_entries));
    int32_t first_batch = -1;
    if (lane_index() == 0) first_batch = allocate_faces(task, image, listed);
    __syncwarp();
    copy_words(task.pool.contexts + image, state->context);
    first_batch = __shfl_sync(kAllLanes, first_batch, 0);
    const int32_t batches = first_batch >= 0 ? FaceBatch::count_of(listed) : 0;
    PICTURA_NO_UNROLL
    for (int32_t batch = lane_index(); batch < batches; batch += kWarpSize) {
      task.pool.batches[first_batch + batch] = {image, batch * FaceBatch::kEntries};
    }
    __syncwarp();
  }
}

// Sets up the faces that need no clipping, and lists the other faces.
extern "C" __global__ void __launch_bounds__(kSetupThreads, kFaceSetupBlocksPerProcessor)
    pictura_setup_faces(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  FaceSetupState* state = face_setup_state();
  DrawCounters* counters = task.counters;
  const int32_t num_batches = counters->batches, num_blocks = static_cast<int32_t>(gridDim.x);
  // Batches take about equal time, so each block takes every num_blocks-th batch. The warp prefetches the next batch,
  // and the descriptor of the batch after it.
  auto i = static_cast<int32_t>(blockIdx.x);
  auto batch_at = [&](int32_t at) { return at < num_batches ? task.pool.batches[at] : FaceBatch{}; };
  FaceBatch next = batch_at(i), after = batch_at(i + num_blocks);
  int32_t turn = 0;
  uint32_t entry = kNoEntry;
  auto prefetch_next = [&] {
    entry = entries_of(task.pool.lists, next.image)[next.first_entry + lane_index()];
    copy_words_async(&state->contexts[turn], task.pool.contexts[next.image]);
  };
  if (i < num_batches) prefetch_next();
  PICTURA_NO_UNROLL
  for (; i < num_batches; i += num_blocks) {
    const FaceSetupContext& context = state->contexts[turn];
    const int32_t image = next.image;
    const uint32_t its_entry = entry;
    wait_for_copies();
    __syncwarp();
    turn = 1 - turn;
    next = after;
    if (i + num_blocks < num_batches) prefetch_next();
    after = batch_at(i + 2 * num_blocks);
    make_faces(context, &state->storage, task.pool.lists, &counters->listed, its_entry, image);
    __syncwarp();
  }
}

// Clips the listed faces and sets up lights.
extern "C" __global__ void __launch_bounds__(kSetupThreads, kClipBlocksPerProcessor)
    pictura_clip(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  ClipShared* storage = &geometry_shared()->clip;
  DrawCounters* counters = task.counters;
  const SetupCounts listed = counters->listed;
  // Faces are spread over all warps, because each face is a long chain of dependent instructions.
  const auto num_blocks = static_cast<int32_t>(gridDim.x);
  const int batch = clamp((listed.clipped + num_blocks - 1) / num_blocks, 1, kWarpSize);
  PICTURA_NO_UNROLL
  for (auto i = static_cast<int32_t>(blockIdx.x);; i = num_blocks + warp_next(&counters->next_clipped)) {
    const ClippedItem item = clipped_item(task.pool.lists, listed, i, batch);
    if (!item.exists) return;
    if (!clip_primitives(task.pool.contexts, storage, item.is_active, item.are_lights, item.primitive) &&
        atomicMin(&task.pool.images[item.primitive.image].face_count, kNotPrepared) >= 0) {
      defer(task, item.primitive.image);
    }
    __syncwarp();
  }
}

// Tiles below the last row are empty.
__device__ inline Part tile_of(const CameraSlot& slot, int32_t tile) {
  const TileGrid& tiles = slot.tiles;
  const int height = height_px(slot.camera);
  return tile_at(tile % tiles.across * tiles.tile_width_px, min_of(tile / tiles.across * kTileHeight_px, height),
                 tiles.tile_width_px, kTileHeight_px, width_px(slot.camera), height);
}

extern "C" __global__ void __launch_bounds__(kDrawThreads, kDrawBlocksPerProcessor)
    pictura_draw(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  BlockState* state = block_state();
  int32_t* const counter = &task.counters->next_drawn;
  // While the block draws a tile, one thread of the last warp, which has the least work, prefetches the next tile and
  // its image.
  DrawOrder order(task);
  int32_t next_image = -1, after = 0;
  auto take_next = [&] {
    next_image = order.image_of(after / task.max_tiles);
    if (next_image < 0) return;
    state->upcoming_part = tile_of(task.cameras[camera_of(task, next_image)], after % task.max_tiles);
    after = atomicAdd(counter, 1);
    const PreparedImage* image = task.pool.images + next_image;
    for (size_t at = 0; at < sizeof(PreparedImage); at += sizeof(uint64_t)) {
      copy_into_shared(reinterpret_cast<char*>(&state->upcoming) + at, reinterpret_cast<const char*>(image) + at);
    }
  };
  const bool is_prefetcher = static_cast<int>(threadIdx.x) == kDrawThreads - kWarpSize;
  if (is_prefetcher) {
    after = atomicAdd(counter, 1);
    take_next();
  }
  reset_part(SmallDrawMemory::current());
  PICTURA_NO_UNROLL
  for (;;) {
    if (is_prefetcher) {
      wait_for_copies();
      state->image = next_image;
      state->part = state->upcoming_part;
      state->current = state->upcoming;
      state->faces = task.pool.faces + state->current.face_begin;
      state->edges = task.pool.edges;
    }
    sync_block();
    const int32_t image = state->image;
    const Part part = state->part;
    if (image < 0) return;
    if (is_prefetcher) take_next();
    if (part.num_rows() > 0 && state->current.face_count >= 0) {
      if (!draw_image_part(SmallDrawMemory::current(), task, view_of(task, image), camera_of(task, image), part) &&
          threadIdx.x == 0 && atomicExch(&task.pool.images[image].has_overflowed, 1) == 0) {
        mark_overflowed(task, image);
      }
    } else {
      sync_block();
    }
  }
}

// Returns false if the image does not fit into memory, or if its view is invalid. Collective over the block.
template <typename Memory>
__device__ bool prepare_and_draw(const DrawTask& task, int32_t image, const SetupTarget& target) {
  const int32_t view = view_of(task, image), camera = camera_of(task, image);
  const PinholeCamera& in_ego = task.cameras[camera].camera;
  return prepare_image(task, view, camera, target, true) &&
         for_each_tile(
             Memory::current(), width_px(in_ego), 0, height_px(in_ego),
             [&](const auto& memory, const Part& part) { return draw_image_part(memory, task, view, camera, part); });
}

__host__ __device__ inline size_t deferred_bytes() {
  const size_t to_set_up = setup_bytes(kDrawThreads), to_draw = draw_bytes();
  return to_set_up > to_draw ? to_set_up : to_draw;
}

// Draws the deferred images in the pool's memory, one image per block at a time.
extern "C" __global__ void __launch_bounds__(kDrawThreads, kDeferredBlocksPerProcessor)
    pictura_draw_deferred(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  const int32_t count = task.counters->deferred;
  const auto block = static_cast<int32_t>(blockIdx.x), num_blocks = static_cast<int32_t>(gridDim.x);
  const FacePool& pool = task.pool;
  const int32_t clipped_edges = (pool.max_edges - 4 * pool.max_faces) / num_blocks;
  const int32_t clipped_begin = 4 * pool.max_faces + block * clipped_edges;
  const SetupTarget target{
      pool.faces + block * kMaxEntries,
      pool.edges,
      4 * block * kMaxEntries,
      clipped_begin,
      clipped_begin + clipped_edges,
      {entries_of(pool.lists, block), pool.lists.clipped + block * kMaxEntries, kMaxEntries, kMaxEntries}};
  PICTURA_NO_UNROLL
  for (int32_t i = block; i < count; i += num_blocks) {
    const int32_t image = task.deferred_images[i];
    if (!prepare_and_draw<SmallDrawMemory>(task, image, target) && threadIdx.x == 0) mark_overflowed(task, image);
  }
}

extern "C" __global__ void __launch_bounds__(kLargeThreads)
    pictura_draw_overflow(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  wait_for_earlier_launch();
  claim_scratch(scratch);
  const BlockState* state = block_state();
  const int32_t count = task.counters->overflow;
  PICTURA_NO_UNROLL
  for (int32_t i = static_cast<int32_t>(blockIdx.x); i < count; i += static_cast<int32_t>(gridDim.x)) {
    const int32_t image = task.overflow_images[i];
    const bool is_drawn = prepare_and_draw<LargeDrawMemory>(task, image, setup_target_of(state->scratch));
    if (!is_drawn && threadIdx.x == 0) record_fault(task, view_of(task, image), FaultKind::capacity_exceeded);
  }
  sync_block();
  if (threadIdx.x == 0 && atomicAdd(&task.counters->finished_blocks, 1) + 1 == static_cast<int32_t>(gridDim.x)) {
    *task.counters = {};
  }
}

extern "C" __global__ void __launch_bounds__(kLargeThreads)
    pictura_visibility(const __grid_constant__ VisibilityTask task, const __grid_constant__ Scratch scratch) {
  wait_for_earlier_launch();
  claim_scratch(scratch);
  BlockState* state = block_state();
  const int32_t num_drawn = num_drawn_views(task.draw);
  PICTURA_NO_UNROLL
  for (int32_t q = static_cast<int32_t>(blockIdx.x); q < task.num_queries; q += static_cast<int32_t>(gridDim.x)) {
    const auto [view, agent] = task.queries[q];
    auto fault = [&](int32_t index, FaultKind kind) {
      if (threadIdx.x == 0) record_fault(task.draw, index, kind);
    };
    VisibilitySum sum;
    const bool is_view = view >= 0 && view < task.draw.num_views;
    if (!is_view) fault(q, FaultKind::bad_query);
    PICTURA_NO_UNROLL
    for (int32_t camera = 0; is_view && view < num_drawn && camera < num_cameras(task.draw); ++camera) {
      // Occlusion culling is off, because occluded faces count when the agent is drawn alone.
      if (!prepare_image(task.draw, view, camera, setup_target_of(state->scratch), false)) {
        if (state->usable != 0) fault(view, FaultKind::capacity_exceeded);
        continue;
      }
      if (agent < state->view.world_begin || agent >= state->view.world_end) {
        fault(q, FaultKind::bad_query);
        break;
      }
      if (!accumulate_visibility(state, make_object_id(kAgentKind, agent - state->view.world_begin), &sum)) {
        fault(view, FaultKind::capacity_exceeded);
      }
    }
    // Drawing is complete, so its memory is free for the sums.
    auto* of_thread = reinterpret_cast<int64_t*>(state->scratch.bytes);
    const VisibilitySum all{block_sum(of_thread, sum.among_all), block_sum(of_thread, sum.alone)};
    if (threadIdx.x == 0) task.visibility[q] = all.share();
    sync_block();
  }
}

}  // namespace pictura::cuda
