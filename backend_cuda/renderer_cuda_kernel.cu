#include "pictura/backend_cuda/renderer_cuda_kernel.h"

namespace pictura::cuda {

namespace {

constexpr int kThreads = 128;

// What the threads of a block share while they draw an image.
struct BlockState {
  ImageSetting setting;
  const RasterGeometry* geometry;
  View view;
  int32_t world_begin, world_end, light_begin, light_end;
  int32_t num_items, num_faces, num_edges, num_background, num_foreground;
  int32_t overflow, usable;
  unsigned long long next;                        // of the items left, waiting weight and place of the one to draw
  uint32_t lowest_foot, strips_low, strips_high;  // ordered_bits of floats
  double sums[kThreads];
};

// Shared memory is not initialised, and the state's members would be.
__device__ BlockState& block_state() {
  alignas(BlockState) __shared__ unsigned char bytes[sizeof(BlockState)];
  return *reinterpret_cast<BlockState*>(bytes);
}

// Floats as integers that sort alike, for atomicMin and atomicMax.
__device__ uint32_t ordered_bits(float value) {
  const uint32_t bits = __float_as_uint(value);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}
__device__ float from_ordered_bits(uint32_t bits) {
  return __uint_as_float(bits & 0x80000000u ? bits & 0x7FFFFFFFu : ~bits);
}

__device__ bool is_finite(float value) { return fabsf(value) <= 3.4e38f; }

// A block's part of the scratch memory.
struct BlockScratch {
  RasterItem* items;
  ScreenFace* faces;
  PolygonEdge* edges;
  int32_t *order, *foreground;
  int64_t* waiting;
  int32_t max_items, max_faces, max_edges;
};

__device__ BlockScratch scratch_of(const Scratch& all, int block) {
  const size_t items = static_cast<size_t>(block) * static_cast<size_t>(all.max_items);
  return {all.items + items,
          all.faces + static_cast<size_t>(block) * static_cast<size_t>(all.max_faces),
          all.edges + static_cast<size_t>(block) * static_cast<size_t>(all.max_edges),
          all.order + items,
          all.foreground + items,
          all.waiting + items,
          all.max_items,
          all.max_faces,
          all.max_edges};
}

// Room for edges, shared by the block's threads.
struct EdgePool {
  BlockState* state;
  const BlockScratch* scratch;
  __device__ int32_t take(int count) {
    const int32_t begin = atomicAdd(&state->num_edges, count);
    if (begin + count <= scratch->max_edges) return begin;
    state->overflow = 1;
    return -1;
  }
  __device__ PolygonEdge* at(int32_t index) { return scratch->edges + index; }
};

// Takes the faces that a thing emits.
struct FaceSink {
  const ImageSetting* setting;
  EdgePool pool;
  ItemFaces faces;
  __device__ void operator()(const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
    add_face(*setting, corners, count, plane, color, pool, &faces);
  }
};

__device__ void store_item(BlockState* state, const BlockScratch& scratch, RasterItem item, const ItemFaces& faces) {
  if (faces.count == 0) return;
  const int32_t at = atomicAdd(&state->num_items, 1);
  const int32_t face_begin = atomicAdd(&state->num_faces, faces.count);
  if (at >= scratch.max_items || face_begin + faces.count > scratch.max_faces) {
    state->overflow = 1;
    return;
  }
  item.box = faces.box;
  item.face_begin = face_begin;
  item.face_end = face_begin + faces.count;
  scratch.items[at] = item;
  for (int i = 0; i < faces.count; ++i) scratch.faces[face_begin + i] = faces.face[i];
}

// The first fault stands until the host has thrown it.
__device__ void note_fault(const DrawTask& task, int32_t view, FaultKind kind) {
  if (atomicCAS(&task.fault->view, -1, view) == -1) task.fault->kind = kind;
}

// Sets what a view shows; false, with a fault noted, where it names something that does not exist.
__device__ bool set_view(BlockState* state, const DrawTask& task, int32_t view_index) {
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

// Collects what the image shows. All threads of the block.
__device__ void gather(BlockState* state, const BlockScratch& scratch, const DrawTask& task) {
  const ImageSetting& setting = state->setting;
  const RasterGeometry& geometry = *state->geometry;
  const int lane = static_cast<int>(threadIdx.x);
  auto add = [&](const RasterItem& item, auto&& make_faces) {
    FaceSink sink{&setting, {state, &scratch}, {}};
    make_faces(sink);
    store_item(state, scratch, item, sink.faces);
  };

  for (int32_t agent = state->world_begin + lane; agent < state->world_end; agent += kThreads) {
    const AgentBox box = task.scene.agents[static_cast<size_t>(agent)];
    if (!may_show(box, setting.camera, setting.frustum)) continue;
    if (is_left_out(state->view, task.scene.hidden_agents, agent)) continue;
    add(agent_item(setting, box, agent, state->world_begin),
        [&](auto&& emit) { agent_faces(box, setting.camera, setting.debug_palette, emit); });
  }
  const float wall_far_m = far_of(geometry.longest_wall_m);
  for_each_item(
      geometry.pieces.wall_grid, frustum_ground_box(setting.camera, setting.frustum, wall_far_m),
      [&](int32_t i) { return ground_box(geometry.pieces.walls[static_cast<size_t>(i)]); },
      [&](int32_t i) {
        const WallFace& wall = geometry.pieces.walls[static_cast<size_t>(i)];
        if (!may_show(wall, setting.camera, setting.frustum, wall_far_m)) return;
        add(wall_item(setting, wall, i), [&](auto&& emit) { wall_faces(wall, setting.camera, emit); });
      },
      lane, kThreads);
  if (state->light_end > state->light_begin) {
    for (int32_t i = lane; i < static_cast<int32_t>(geometry.pieces.heads.size()); i += kThreads) {
      const LightHead& head = geometry.pieces.heads[static_cast<size_t>(i)];
      if (!may_show(head, setting.camera, setting.frustum)) continue;
      const LightState light = task.scene.light_states[static_cast<size_t>(state->light_begin + head.signal)];
      add(light_item(setting, head, i), [&](auto&& emit) { light_faces(head, light, setting.camera, emit); });
    }
  }
  const float strip_far_m = far_of(geometry.longest_strip_m);
  for_each_item(
      geometry.pieces.strip_grid, frustum_ground_box(setting.camera, setting.frustum, strip_far_m),
      [&](int32_t i) { return ground_box(geometry.pieces.strips[static_cast<size_t>(i)]); },
      [&](int32_t i) {
        const Strip& strip = geometry.pieces.strips[static_cast<size_t>(i)];
        if (!may_show(strip, setting.camera, setting.frustum, strip_far_m)) return;
        add(strip_item(setting, strip, i),
            [&](auto&& emit) { strip_faces(strip, setting.camera, setting.line_floor_px, emit); });
      },
      lane, kThreads);
  __syncthreads();
}

// Tells strips of level ground from what needs a pairwise order. All threads of the block.
__device__ void find_background(BlockState* state, const BlockScratch& scratch) {
  const int lane = static_cast<int>(threadIdx.x);
  for (int32_t i = lane; i < state->num_items; i += kThreads) {
    const Extent& extent = scratch.items[i].extent;
    const Interval heights = heights_of(extent);
    if (extent.is_strip) {
      atomicMin(&state->strips_low, ordered_bits(heights.low));
      atomicMax(&state->strips_high, ordered_bits(heights.high));
    } else {
      atomicMin(&state->lowest_foot, ordered_bits(heights.low));
    }
  }
  __syncthreads();
  const GroundHeights heights{from_ordered_bits(state->lowest_foot),
                              {from_ordered_bits(state->strips_low), from_ordered_bits(state->strips_high)}};
  if (ground_is_level(heights)) {
    for (int32_t i = lane; i < state->num_items; i += kThreads) {
      if (scratch.items[i].extent.is_strip) put_in_background(&scratch.items[i]);
    }
  }
  __syncthreads();
}

// Puts the items in order, front to back. All threads of the block.
__device__ void sort_items(BlockState* state, const BlockScratch& scratch) {
  const int lane = static_cast<int>(threadIdx.x);
  const int32_t count = state->num_items;
  for (int32_t i = lane; i < count; i += kThreads) {
    if (!scratch.items[i].is_background) atomicAdd(&state->num_foreground, 1);
  }
  __syncthreads();
  const int32_t foreground = state->num_foreground;
  // Keys are unique, so an item's place is the number of those before it.
  for (int32_t i = lane; i < count; i += kThreads) {
    const RasterItem& item = scratch.items[i];
    int32_t place = 0;
    for (int32_t j = 0; j < count; ++j) {
      const RasterItem& other = scratch.items[j];
      place += other.is_background == item.is_background && other.key < item.key;
    }
    if (item.is_background) {
      scratch.order[foreground + place] = i;
    } else {
      scratch.foreground[place] = i;
    }
  }
  __syncthreads();
  // Weight of what must be drawn before each item; taking one lets go of what it is in front of.
  auto weight_before = [&](int32_t first, int32_t second) {
    const RasterItem& a = scratch.items[scratch.foreground[min_of(first, second)]];
    const RasterItem& b = scratch.items[scratch.foreground[max_of(first, second)]];
    const int32_t order = order_on_screen(a, b, scratch.faces, scratch.edges);
    return max_of(first < second ? -order : order, 0);
  };
  for (int32_t i = lane; i < foreground; i += kThreads) {
    int64_t waiting = 0;
    for (int32_t j = 0; j < foreground; ++j) waiting += j != i ? weight_before(j, i) : 0;
    scratch.waiting[i] = waiting;
  }
  constexpr int64_t kTaken = -1;
  constexpr int kPlaceBits = 24;
  constexpr unsigned long long kNone = ~0ull;
  for (int32_t taken = 0; taken < foreground; ++taken) {
    if (lane == 0) state->next = kNone;
    __syncthreads();
    // The nearest that nothing is in front of; in a cycle, the one of which least is hidden.
    unsigned long long best = kNone;
    for (int32_t i = lane; i < foreground; i += kThreads) {
      if (scratch.waiting[i] == kTaken) continue;
      const unsigned long long candidate =
          static_cast<unsigned long long>(scratch.waiting[i]) << kPlaceBits | static_cast<unsigned long long>(i);
      best = candidate < best ? candidate : best;
    }
    atomicMin(&state->next, best);
    __syncthreads();
    const int32_t next = static_cast<int32_t>(state->next & ((1ull << kPlaceBits) - 1));
    for (int32_t i = lane; i < foreground; i += kThreads) {
      if (i == next) {
        scratch.order[taken] = scratch.foreground[next];
        scratch.waiting[i] = kTaken;
      } else if (scratch.waiting[i] > 0) {
        scratch.waiting[i] -= weight_before(next, i);
      }
    }
    __syncthreads();
  }
}

// Gathers and orders one image; false where there is nothing to draw or no room. All threads of the block.
__device__ bool prepare(BlockState* state, const BlockScratch& scratch, const DrawTask& task, int32_t view,
                        int32_t camera) {
  __syncthreads();
  if (threadIdx.x == 0) {
    state->num_items = state->num_faces = state->num_edges = state->num_foreground = 0;
    state->overflow = 0;
    const GroundHeights none;
    state->lowest_foot = ordered_bits(none.lowest_foot_m);
    state->strips_low = ordered_bits(none.strips.low);
    state->strips_high = ordered_bits(none.strips.high);
    state->usable = set_view(state, task, view) ? 1 : 0;
    if (state->usable) {
      const PinholeCamera placed = place_camera(task.cameras[camera].camera, state->view);
      state->setting = {placed, make_frustum(placed), task.line_floor_px, task.debug_palette};
    }
  }
  __syncthreads();
  if (!state->usable) return false;
  gather(state, scratch, task);
  if (state->overflow) return false;
  find_background(state, scratch);
  sort_items(state, scratch);
  return true;
}

__device__ void draw_image(const BlockState& state, const BlockScratch& scratch, const DrawTask& task, int32_t view,
                           const CameraSlot& slot, bool empty) {
  const int width = slot.camera.width_px, height = slot.camera.height_px;
  const int64_t plane = static_cast<int64_t>(width) * height;
  const int64_t first = view * slot.view_stride;
  const int32_t count = empty ? 0 : state.num_items;
  for (int64_t p = threadIdx.x; p < plane; p += kThreads) {
    const int x = static_cast<int>(p % width), y = static_cast<int>(p / width);
    const float x_px = static_cast<float>(x) + 0.5f, y_px = static_cast<float>(y) + 0.5f;
    const bool wants_front = slot.depth_m || slot.class_id || slot.instance_id;
    const RasterItem* front = nullptr;
    float depth_m = __uint_as_float(0x7F800000u);  // infinity
    PixelState pixel;
    for (int32_t k = 0; k < count; ++k) {
      const RasterItem& item = scratch.items[scratch.order[k]];
      const PixelBox box = item.box;
      if (x < box.x_begin || x >= box.x_end || y < box.y_begin || y >= box.y_end) continue;
      for (int32_t f = item.face_begin; f < item.face_end; ++f) {
        const ScreenFace& face = scratch.faces[f];
        if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) continue;
        const PolygonEdge* edges = scratch.edges + face.edge_begin;
        composite(&pixel, pixel_coverage(edges, face.edge_count, x, y), face.color);
        if (wants_front && !front && covers_point(edges, face.edge_count, x_px, y_px)) {
          front = &item;
          depth_m = face_depth_m(face, x_px, y_px);
        }
      }
      if (pixel.free_area <= 0.0f && (front || !wants_front)) break;
    }
    const float channels[3] = {pixel.color.r, pixel.color.g, pixel.color.b};
    for (int channel = 0; channel < 3; ++channel) {
      const int64_t at = first + channel * plane + p;
      if (task.as_float) {
        static_cast<float*>(slot.color)[at] = clamp(channels[channel], 0.0f, 1.0f);
      } else {
        static_cast<uint8_t*>(slot.color)[at] = to_byte(channels[channel]);
      }
    }
    if (slot.depth_m) slot.depth_m[view * plane + p] = depth_m;
    if (slot.class_id) slot.class_id[view * plane + p] = front ? front->class_id : uint8_t{0};
    if (slot.instance_id)
      slot.instance_id[view * plane + p] = front ? instance_of(*front, state.world_begin) : uint16_t{0};
  }
}

__device__ void draw_or_defer(BlockState* state, const BlockScratch& scratch, const DrawTask& task, int32_t image,
                              bool may_defer) {
  const int32_t view = image / task.num_cameras, camera = image % task.num_cameras;
  const bool prepared = prepare(state, scratch, task, view, camera);
  if (!prepared && state->usable && state->overflow && may_defer) {
    if (threadIdx.x == 0) task.overflow_images[atomicAdd(task.overflow_count, 1)] = image;
    return;
  }
  if (!prepared && state->usable && threadIdx.x == 0) note_fault(task, view, kNoRoom);
  draw_image(*state, scratch, task, view, task.cameras[camera], !prepared);
}

__global__ void __launch_bounds__(kThreads)
    draw_kernel(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch all) {
  BlockState& state = block_state();
  const BlockScratch scratch = scratch_of(all, static_cast<int>(blockIdx.x));
  const int32_t images = task.num_views * task.num_cameras;
  for (int32_t image = static_cast<int32_t>(blockIdx.x); image < images; image += static_cast<int32_t>(gridDim.x)) {
    draw_or_defer(&state, scratch, task, image, true);
  }
}

__global__ void __launch_bounds__(kThreads)
    draw_overflow_kernel(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch all) {
  BlockState& state = block_state();
  const BlockScratch scratch = scratch_of(all, static_cast<int>(blockIdx.x));
  const int32_t count = *task.overflow_count;
  for (int32_t i = static_cast<int32_t>(blockIdx.x); i < count; i += static_cast<int32_t>(gridDim.x)) {
    draw_or_defer(&state, scratch, task, task.overflow_images[i], false);
  }
}

// Sum over the threads, in their order.
__device__ double block_sum(BlockState* state, double value) {
  __syncthreads();
  state->sums[threadIdx.x] = value;
  __syncthreads();
  double sum = 0;
  for (int i = 0; i < kThreads; ++i) sum += state->sums[i];
  return sum;
}

__global__ void __launch_bounds__(kThreads)
    visibility_kernel(const __grid_constant__ VisibilityTask task, const __grid_constant__ Scratch all) {
  BlockState& state = block_state();
  const BlockScratch scratch = scratch_of(all, static_cast<int>(blockIdx.x));
  for (int32_t q = static_cast<int32_t>(blockIdx.x); q < task.num_queries; q += static_cast<int32_t>(gridDim.x)) {
    const int32_t view = task.queries[2 * q], agent = task.queries[2 * q + 1];
    double seen = 0, alone = 0;
    const bool in_range = view >= 0 && view < task.draw.num_views && agent >= 0 &&
                          agent < static_cast<int32_t>(task.draw.scene.agents.size());
    if (!in_range && threadIdx.x == 0) note_fault(task.draw, q, kBadQuery);
    for (int32_t camera = 0; in_range && camera < task.draw.num_cameras; ++camera) {
      if (!prepare(&state, scratch, task.draw, view, camera)) continue;
      int32_t wanted = 0;
      while (wanted < state.num_items && scratch.items[scratch.order[wanted]].agent != agent) ++wanted;
      if (wanted == state.num_items) continue;
      const PixelBox box = scratch.items[scratch.order[wanted]].box;
      const int width = box.x_end - box.x_begin;
      const int pixels = width * (box.y_end - box.y_begin);
      for (int p = static_cast<int>(threadIdx.x); p < pixels; p += kThreads) {
        const int x = box.x_begin + p % width, y = box.y_begin + p / width;
        auto weigh = [&](int32_t begin) {
          PixelState pixel;
          double weight = 0;
          for (int32_t k = begin; k <= wanted; ++k) {
            const RasterItem& item = scratch.items[scratch.order[k]];
            for (int32_t f = item.face_begin; f < item.face_end; ++f) {
              const ScreenFace& face = scratch.faces[f];
              if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) continue;
              const PixelCoverage coverage = pixel_coverage(scratch.edges + face.edge_begin, face.edge_count, x, y);
              const float laid = composite(&pixel, coverage, face.color);
              if (k == wanted) weight += static_cast<double>(laid);
            }
          }
          return weight;
        };
        seen += weigh(0);
        alone += weigh(wanted);
      }
    }
    const double all_seen = block_sum(&state, seen), all_alone = block_sum(&state, alone);
    if (threadIdx.x == 0) {
      const double share = all_seen / all_alone;  // not a number where the agent is in no frame
      task.visibility[q] = all_alone > 0 ? static_cast<float>(share < 1 ? share : 1.0) : __uint_as_float(0x7FC00000u);
    }
    __syncthreads();
  }
}

}  // namespace

void launch_draw(const DrawTask& task, const Scratch& small, const Scratch& large, cudaStream_t stream) {
  const int images = task.num_views * task.num_cameras;
  if (images == 0) return;
  cudaMemsetAsync(task.overflow_count, 0, sizeof(int32_t), stream);
  draw_kernel<<<min_of(images, small.blocks), kThreads, 0, stream>>>(task, small);
  draw_overflow_kernel<<<min_of(images, large.blocks), kThreads, 0, stream>>>(task, large);
}

void launch_visibility(const VisibilityTask& task, const Scratch& large, cudaStream_t stream) {
  if (task.num_queries == 0) return;
  visibility_kernel<<<min_of(task.num_queries, large.blocks), kThreads, 0, stream>>>(task, large);
}

}  // namespace pictura::cuda
