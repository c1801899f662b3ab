// The drawing kernels, and how much memory their blocks need. Compiled ahead of time by renderer_cuda_launch.cu, and at
// run time from a copy of this file and of all that it includes.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_faces.cuh"
#include "pictura/backend_cuda/renderer_cuda_fragments.cuh"
#include "pictura/backend_cuda/renderer_cuda_rig.cuh"

namespace pictura::cuda {

// Most images fit into a block of this much.
constexpr int kSmallBlocksPerProcessor = 3;
constexpr int kSmallFaces = 1280, kSmallEdges = 5120, kSmallPieces = 1 << 17, kSmallPixels = 96 * 54,
              kSmallFragments = 1920;
static_assert(kSmallFaces <= kMostMarkedFaces && kSmallFragments < 0xFFFF);

using SmallMemory = BlockMemory<uint16_t, uint32_t>;
using LargeMemory = BlockMemory<uint32_t, unsigned long long>;

// Bytes of a block's memory besides its faces and edges: what is used while things are gathered lies where pixels and
// fragments do later.
template <typename Memory>
__host__ __device__ size_t gather_bytes(int max_faces, int max_pieces) {
  return sizeof(uint32_t) * (static_cast<size_t>(max_faces) + static_cast<size_t>(max_pieces) / 32);
}
template <typename Memory>
__host__ __device__ size_t pixel_bytes(int max_pixels, int max_fragments) {
  return sizeof(typename Memory::Word) * static_cast<size_t>(max_pixels) +
         sizeof(StoredFragment<typename Memory::Index>) * static_cast<size_t>(max_fragments);
}
template <typename Memory>
__host__ __device__ size_t memory_bytes(int max_faces, int max_pieces, int max_pixels, int max_fragments) {
  const size_t gathered = gather_bytes<Memory>(max_faces, max_pieces);
  const size_t pixels = pixel_bytes<Memory>(max_pixels, max_fragments);
  const size_t shared_part = gathered > pixels ? gathered : pixels;
  return (shared_part + sizeof(uint32_t) * (static_cast<size_t>(max_faces) + 2) + 7) / 8 * 8;
}

template <typename Memory>
__device__ Memory memory_at(unsigned char* bytes, BlockState* state, const Scratch& scratch, int block,
                            int max_pixels) {
  Memory memory;
  memory.state = state;
  memory.max_faces = scratch.max_faces;
  memory.max_edges = scratch.max_edges;
  memory.max_pieces = scratch.max_pieces;
  memory.max_pixels = max_pixels;
  memory.max_fragments = scratch.max_fragments;
  memory.faces = scratch.faces + static_cast<size_t>(block) * static_cast<size_t>(scratch.max_faces);
  memory.edges = scratch.edges + static_cast<size_t>(block) * static_cast<size_t>(scratch.max_edges);
  memory.pixels = reinterpret_cast<typename Memory::Word*>(bytes);
  memory.fragments = reinterpret_cast<StoredFragment<typename Memory::Index>*>(memory.pixels + max_pixels);
  memory.seen = reinterpret_cast<uint32_t*>(bytes);
  memory.visible = memory.seen + scratch.max_pieces / 32;
  const size_t gathered = gather_bytes<Memory>(scratch.max_faces, scratch.max_pieces);
  const size_t pixels = pixel_bytes<Memory>(max_pixels, scratch.max_fragments);
  memory.first_job = reinterpret_cast<uint32_t*>(bytes + (gathered > pixels ? gathered : pixels));
  return memory;
}

constexpr size_t kStateBytes = (sizeof(BlockState) + 15) / 16 * 16;

__host__ __device__ inline size_t small_bytes() {
  return kStateBytes + memory_bytes<SmallMemory>(kSmallFaces, kSmallPieces, kSmallPixels, kSmallFragments);
}

// Stores a pixel's colour: element `at` of the first channel, and as far behind it as a plane is large for the others.
__device__ inline void write_color(const DrawTask& task, const CameraSlot& slot, int64_t at, int64_t plane, Rgb color) {
  const float channels[3] = {color.r, color.g, color.b};
  for (int channel = 0; channel < 3; ++channel) {
    const int64_t element = at + channel * plane;
    if (task.format == PixelFormat::u8) {
      static_cast<uint8_t*>(slot.color)[element] = to_byte(channels[channel]);
    } else if (task.format == PixelFormat::f16) {
      static_cast<uint16_t*>(slot.color)[element] = to_half(channels[channel]);
    } else {
      static_cast<float*>(slot.color)[element] = clamp(channels[channel], 0.0f, 1.0f);
    }
  }
}

// Writes the optional planes: the front surface at each pixel's centre.
template <typename Memory>
__device__ void draw_planes(const Memory& memory, const DrawTask& task, const CameraSlot& slot, int32_t view,
                            int num_faces) {
  const int width = width_px(slot.camera);
  const int64_t plane = static_cast<int64_t>(width) * height_px(slot.camera);
  for (int64_t p = threadIdx.x; p < plane; p += kThreads) {
    const int x = static_cast<int>(p % width), y = static_cast<int>(p / width);
    const Vec2 center = pixel_middle(x, y);
    FrontFace front;
    auto each = [&](auto&& take) {
      for (int i = 0; i < num_faces; ++i) {
        const ScreenFace& face = memory.faces[i];
        if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) continue;
        if (covers_point(memory.edges + face.edge_begin, face.edge_count, center.x, center.y)) take(face);
      }
    };
    each([&](const ScreenFace& face) { front.offer(face, center); });
    each([&](const ScreenFace& face) { front.offer_again(face, center); });
    const ScreenFace* face =
        front.front(center, [&](uint32_t solid, uint32_t strip) { return stands(memory, task, solid, strip); });
    const int64_t at = view * plane + p;
    const float infinity = __uint_as_float(0x7F800000u);
    if (slot.depth_m) slot.depth_m[at] = face ? face_depth_m(*face, center) : infinity;
    if (slot.class_id) slot.class_id[at] = face ? face->class_id : uint8_t{0};
    if (slot.instance_id) slot.instance_id[at] = face ? instance_of(*face) : uint16_t{0};
  }
}

// False where the image has outgrown the block's memory.
template <typename Memory>
__device__ bool draw_image(const Memory& memory, const DrawTask& task, int32_t view, int32_t camera) {
  const CameraSlot& slot = task.cameras[camera];
  const int width = width_px(slot.camera), height = height_px(slot.camera);
  if (width > memory.max_pixels) return false;
  const bool prepared = prepare(memory, task, view, camera);
  if (!prepared && memory.state->usable) return false;
  const int num_faces = prepared ? memory.state->num_visible : 0;
  const int64_t plane = static_cast<int64_t>(width) * height;
  const int64_t first = view * slot.view_stride;
  const bool drawn = draw_faces(
      memory, task, num_faces, width, 0, height, [](const Fragment&, float) {},
      [&](int x, int y, Rgb color) {
        write_color(task, slot, first + static_cast<int64_t>(y) * width + x, plane, color);
      });
  if (drawn && task.wants_planes) draw_planes(memory, task, slot, view, num_faces);
  return drawn;
}

extern "C" __global__ void __launch_bounds__(kThreads, kSmallBlocksPerProcessor)
    pictura_draw(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  extern __shared__ __align__(16) unsigned char bytes[];
  auto* state = reinterpret_cast<BlockState*>(bytes);
  const SmallMemory memory =
      memory_at<SmallMemory>(bytes + kStateBytes, state, scratch, static_cast<int>(blockIdx.x), kSmallPixels);
  const int32_t images = task.num_views * num_cameras(task);
  for (;;) {
    __syncthreads();
    if (threadIdx.x == 0) state->image = atomicAdd(task.next_image, 1);
    __syncthreads();
    const int32_t image = state->image;
    if (image >= images) return;
    if (!draw_image(memory, task, task.first_view + image / num_cameras(task), image % num_cameras(task)) &&
        threadIdx.x == 0) {
      task.overflow_images[atomicAdd(task.overflow_count, 1)] = image;
    }
  }
}

// Pixels of a band of the second launch: a row of the widest image at least.
constexpr int kLargePixels = 1 << 14;

__device__ inline LargeMemory large_memory(BlockState* state, const Scratch& scratch) {
  const size_t bytes =
      memory_bytes<LargeMemory>(scratch.max_faces, scratch.max_pieces, kLargePixels, scratch.max_fragments);
  return memory_at<LargeMemory>(scratch.bytes + blockIdx.x * bytes, state, scratch, static_cast<int>(blockIdx.x),
                                kLargePixels);
}

extern "C" __global__ void __launch_bounds__(kThreads)
    pictura_draw_overflow(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  alignas(BlockState) __shared__ unsigned char bytes[sizeof(BlockState)];
  auto* state = reinterpret_cast<BlockState*>(bytes);
  const LargeMemory memory = large_memory(state, scratch);
  const int32_t count = *task.overflow_count;
  for (int32_t i = static_cast<int32_t>(blockIdx.x); i < count; i += static_cast<int32_t>(gridDim.x)) {
    const int32_t image = task.overflow_images[i];
    const int32_t view = task.first_view + image / num_cameras(task);
    if (!draw_image(memory, task, view, image % num_cameras(task)) && threadIdx.x == 0) note_fault(task, view, kNoRoom);
  }
}

extern "C" __global__ void __launch_bounds__(kThreads)
    pictura_visibility(const __grid_constant__ VisibilityTask task, const __grid_constant__ Scratch scratch) {
  alignas(BlockState) __shared__ unsigned char bytes[sizeof(BlockState)];
  auto* state = reinterpret_cast<BlockState*>(bytes);
  const LargeMemory memory = large_memory(state, scratch);
  for (int32_t q = static_cast<int32_t>(blockIdx.x); q < task.num_queries; q += static_cast<int32_t>(gridDim.x)) {
    const int32_t view = task.queries[2 * q], agent = task.queries[2 * q + 1];
    double seen = 0, alone = 0;
    const bool in_range = view >= 0 && view < task.draw.num_views && agent >= 0 &&
                          agent < static_cast<int32_t>(task.draw.scene.agents.size());
    if (!in_range && threadIdx.x == 0) note_fault(task.draw, q, kBadQuery);
    for (int32_t camera = 0; in_range && camera < num_cameras(task.draw); ++camera) {
      if (!prepare(memory, task.draw, view, camera)) continue;
      const uint32_t number = thing_number(kAgentKind, agent - state->view.world_begin);
      const int num_faces = state->num_visible;
      int y_begin = state->setting.camera.height_px, y_end = 0;
      for (int i = 0; i < num_faces; ++i) {
        const ScreenFace& face = memory.faces[i];
        if (face.number != number || face.box.y_begin >= face.box.y_end) continue;
        y_begin = min_of(y_begin, face.box.y_begin);
        y_end = max_of(y_end, face.box.y_end);
      }
      auto weigh = [&](double* sum) {
        draw_faces(
            memory, task.draw, num_faces, state->setting.camera.width_px, y_begin, y_end,
            [&](const Fragment& fragment, float weight) {
              if (memory.faces[fragment.face].number == number) *sum += static_cast<double>(weight);
            },
            [](int, int, Rgb) {});
      };
      weigh(&seen);
      // Once more, without all others.
      for (int i = static_cast<int>(threadIdx.x); i < num_faces; i += kThreads) {
        if (memory.faces[i].number != number) memory.faces[i].box = PixelBox{};
      }
      __syncthreads();
      weigh(&alone);
    }
    const double all_seen = block_sum(state, seen), all_alone = block_sum(state, alone);
    if (threadIdx.x == 0) {
      const double share = all_seen / all_alone;  // not a number where the agent is in no frame
      task.visibility[q] = all_alone > 0 ? static_cast<float>(share < 1 ? share : 1.0) : __uint_as_float(0x7FC00000u);
    }
    __syncthreads();
  }
}

}  // namespace pictura::cuda
