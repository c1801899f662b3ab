// The drawing kernels, and how much memory their blocks need. Compiled ahead of time by renderer_cuda_launch.cu, and at
// run time from a copy of this file and of all that it includes.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_faces.cuh"
#include "pictura/backend_cuda/renderer_cuda_fragments.cuh"
#include "pictura/backend_cuda/renderer_cuda_rig.cuh"

namespace pictura::cuda {

// Stores a pixel's colour: element `at` of the first channel, and as far behind it as a plane is large for the others.
__device__ __noinline__ inline void write_color(const DrawTask& task, const CameraSlot& slot, int64_t at, int64_t plane,
                                                Rgb color) {
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
__device__ __noinline__ void draw_planes(const DrawTask& task, const CameraSlot& slot, int32_t view, int num_faces) {
  const Memory memory = Memory::current();
  const int width = width_px(slot.camera);
  const int64_t plane = static_cast<int64_t>(width) * height_px(slot.camera);
  PICTURA_KEEP_LOOP
  for (int64_t p = threadIdx.x; p < plane; p += kThreads) {
    const int x = static_cast<int>(p % width), y = static_cast<int>(p / width);
    const Vec2 center = pixel_middle(x, y);
    FrontFace front;
    auto each = [&](auto&& take) {
      PICTURA_KEEP_LOOP
      for (int i = 0; i < num_faces; ++i) {
        const ScreenFace& face = memory.faces[i];
        if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) continue;
        if (covers_point(memory.edges + face.edge_begin, face.edge_count, center.x, center.y)) take(face);
      }
    };
    each([&](const ScreenFace& face) { front.offer(face, center); });
    each([&](const ScreenFace& face) { front.offer_again(face, center); });
    const ScreenFace* face =
        front.front(center, [&](uint32_t solid, uint32_t strip) { return stands(&task, solid, strip); });
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
  const int num_faces = prepared ? memory.state->num_faces : 0;
  const int64_t plane = static_cast<int64_t>(width) * height;
  const int64_t first = view * slot.view_stride;
  const bool drawn = draw_faces(memory, task, num_faces, width, 0, height, NoVisit{}, [&](int x, int y, Rgb color) {
    write_color(task, slot, first + static_cast<int64_t>(y) * width + x, plane, color);
  });
  if (drawn && task.wants_planes) draw_planes<Memory>(task, slot, view, num_faces);
  return drawn;
}

extern "C" __global__ void __launch_bounds__(kThreads, kSmallBlocksPerProcessor)
    pictura_draw(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  take_scratch(scratch);
  const SmallMemory memory = SmallMemory::current();
  BlockState* state = memory.state;
  const int32_t images = task.num_views * num_cameras(task);
  PICTURA_KEEP_LOOP
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

extern "C" __global__ void __launch_bounds__(kThreads)
    pictura_draw_overflow(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  take_scratch(scratch);
  const LargeMemory memory = LargeMemory::current();
  const int32_t count = *task.overflow_count;
  PICTURA_KEEP_LOOP
  for (int32_t i = static_cast<int32_t>(blockIdx.x); i < count; i += static_cast<int32_t>(gridDim.x)) {
    const int32_t image = task.overflow_images[i];
    const int32_t view = task.first_view + image / num_cameras(task);
    if (!draw_image(memory, task, view, image % num_cameras(task)) && threadIdx.x == 0) note_fault(task, view, kNoRoom);
  }
}

/// Adds up what the faces of an agent weigh.
struct WeighAgent {
  static constexpr bool kWanted = true;
  uint32_t number;
  double* sum;
  __device__ void operator()(const ScreenFace& face, float weight) const {
    if (face.number == number) *sum += static_cast<double>(weight);
  }
};

extern "C" __global__ void __launch_bounds__(kThreads)
    pictura_visibility(const __grid_constant__ VisibilityTask task, const __grid_constant__ Scratch scratch) {
  take_scratch(scratch);
  const LargeMemory memory = LargeMemory::current();
  BlockState* state = memory.state;
  PICTURA_KEEP_LOOP
  for (int32_t q = static_cast<int32_t>(blockIdx.x); q < task.num_queries; q += static_cast<int32_t>(gridDim.x)) {
    const int32_t view = task.queries[2 * q], agent = task.queries[2 * q + 1];
    double seen = 0, alone = 0;
    const bool in_range = view >= 0 && view < task.draw.num_views && agent >= 0 &&
                          agent < static_cast<int32_t>(task.draw.scene.agents.size());
    if (!in_range && threadIdx.x == 0) note_fault(task.draw, q, kBadQuery);
    PICTURA_KEEP_LOOP
    for (int32_t camera = 0; in_range && camera < num_cameras(task.draw); ++camera) {
      if (!prepare(memory, task.draw, view, camera)) continue;
      const uint32_t number = thing_number(kAgentKind, agent - state->view.world_begin);
      const int num_faces = state->num_faces;
      int y_begin = state->setting.camera.height_px, y_end = 0;
      PICTURA_KEEP_LOOP
      for (int i = 0; i < num_faces; ++i) {
        const ScreenFace& face = memory.faces[i];
        if (face.number != number || face.box.y_begin >= face.box.y_end) continue;
        y_begin = min_of(y_begin, face.box.y_begin);
        y_end = max_of(y_end, face.box.y_end);
      }
      auto weigh = [&](double* sum) {
        draw_faces(memory, task.draw, num_faces, state->setting.camera.width_px, y_begin, y_end,
                   WeighAgent{number, sum}, [](int, int, Rgb) {});
      };
      weigh(&seen);
      // Once more, without all others.
      PICTURA_KEEP_LOOP
      for (int i = static_cast<int>(threadIdx.x); i < num_faces; i += kThreads) {
        if (memory.faces[i].number != number) memory.faces[i].box = PixelBox{};
      }
      __syncthreads();
      weigh(&alone);
    }
    const double all_seen = block_sum(seen), all_alone = block_sum(alone);
    if (threadIdx.x == 0) {
      const double share = all_seen / all_alone;  // not a number where the agent is in no frame
      task.visibility[q] = all_alone > 0 ? static_cast<float>(share < 1 ? share : 1.0) : __uint_as_float(0x7FC00000u);
    }
    __syncthreads();
  }
}

}  // namespace pictura::cuda
