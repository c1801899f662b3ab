// The drawing kernels, and how much memory their blocks need. Compiled ahead of time by renderer_cuda_launch.cu, and at
// run time from a copy of this file and of all that it includes.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_faces.cuh"
#include "pictura/backend_cuda/renderer_cuda_pixels.cuh"

namespace pictura::cuda {

/// Writes pixels of an image, a plane for each channel.
struct ImageWriter {
  PixelFormat format;
  void* images;
  int64_t first, plane;  // elements: of this image, and from a plane to the next
  int width_px;

  /// Keeps the colour that a fragment gives its pixel.
  template <typename Memory>
  __device__ void keep(const Memory& memory, int fragment, Rgb color) const {
    if (format == PixelFormat::u8) {
      memory.set_color_bytes(fragment, to_bytes(color));
    } else {
      memory.set_color(fragment, color);
    }
  }

  /// Writes at most kWrittenAtOnce pixels side by side, given their words.
  template <typename Memory>
  __device__ void pixels(const Memory& memory, int x, int y, int count, const typename Memory::Word* words) const {
    const int64_t at = first + static_cast<int64_t>(y) * width_px + x;
    if (format == PixelFormat::u8) {
      write_bytes(memory, static_cast<uint8_t*>(images) + at, count, words);
    } else if (format == PixelFormat::f16) {
      write_numbers(memory, static_cast<uint16_t*>(images) + at, count, words, [](float v) { return to_half(v); });
    } else {
      write_numbers(memory, static_cast<float*>(images) + at, count, words, [](float v) { return saturate(v); });
    }
  }

 private:
  template <typename Value>
  struct alignas(kWrittenAtOnce * sizeof(Value)) Together {
    Value value[kWrittenAtOnce];
  };

  template <typename Memory>
  __device__ void write_bytes(const Memory& memory, uint8_t* to, int count, const typename Memory::Word* words) const {
    // Many warps write nothing but black.
    uint32_t bytes[kWrittenAtOnce] = {};
    typename Memory::Word some = 0;
    for (int i = 0; i < kWrittenAtOnce; ++i) some |= words[i];
    for (int i = 0; i < kWrittenAtOnce && some != 0; ++i) {
      const auto full = full_of_word<Memory>(words[i]), head = first_of_word<Memory>(words[i]);
      bytes[i] = head != Memory::kNone   ? memory.color_bytes(static_cast<int>(head))
                 : full != Memory::kNone ? memory.faces[full].color_bytes
                                         : 0u;
    }
    store_channels(to, count, [&](int i, int channel) { return static_cast<uint8_t>(bytes[i] >> (8 * channel)); });
  }

  template <typename Memory, typename Value, typename ValueOf>
  __device__ void write_numbers(const Memory& memory, Value* to, int count, const typename Memory::Word* words,
                                ValueOf&& value_of) const {
    Rgb colors[kWrittenAtOnce];
    for (int i = 0; i < kWrittenAtOnce; ++i) {
      const auto full = full_of_word<Memory>(words[i]), head = first_of_word<Memory>(words[i]);
      if (head != Memory::kNone) {
        colors[i] = memory.color(static_cast<int>(head));
      } else if (full != Memory::kNone) {
        colors[i] = memory.faces[full].color;
      }
    }
    store_channels(to, count, [&](int i, int channel) {
      return value_of(channel == 0 ? colors[i].r : channel == 1 ? colors[i].g : colors[i].b);
    });
  }

  // value_of(i, channel): of the i-th pixel.
  template <typename Value, typename ValueOf>
  __device__ void store_channels(Value* to, int count, ValueOf&& value_of) const {
    PICTURA_KEEP_LOOP
    for (int channel = 0; channel < 3; ++channel, to += plane) {
      Together<Value> values;
      for (int i = 0; i < kWrittenAtOnce; ++i) values.value[i] = value_of(i, channel);
      store(to, count, values);
    }
  }

  // At once where all are written and lie where such a store may go.
  template <typename Value>
  __device__ static void store(Value* to, int count, const Together<Value>& values) {
    if (count == kWrittenAtOnce && reinterpret_cast<uintptr_t>(to) % sizeof(values) == 0) {
      *reinterpret_cast<Together<Value>*>(to) = values;
      return;
    }
    for (int i = 0; i < kWrittenAtOnce; ++i) {
      if (i < count) to[i] = values.value[i];
    }
  }
};

/// Writes nothing.
struct NoImage {
  template <typename Memory>
  __device__ void keep(const Memory&, int, Rgb) const {}
  template <typename Memory>
  __device__ void pixels(const Memory&, int, int, int, const typename Memory::Word*) const {}
};

// Writes the optional planes of a part: the front surface at each pixel's centre, of the faces that have its row. All
// threads of the block.
template <typename Memory>
__device__ __noinline__ void draw_planes(CameraSlot slot, int32_t view, int num_faces, Part part) {
  using Word = typename Memory::Word;
  const Memory memory = Memory::current();
  sync_block();
  list_rows(memory, num_faces, part);
  sync_block();
  // Those of a row in a chain, which begins where its first pixel was and goes on where candidates were; 0 ends it.
  const int num_rows = memory.state->num_rows;
  const bool has_room = num_rows <= memory.max_rows;
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); has_room && i < num_rows; i += Memory::kThreads) {
    memory.candidates[i] = atomicExch(&memory.pixels[memory.rows[i] & Memory::kNone], static_cast<Word>(i + 1));
  }
  sync_block();
  const int width = width_px(slot.camera);
  const int64_t plane = static_cast<int64_t>(width) * height_px(slot.camera);
  PICTURA_KEEP_LOOP
  for (int p = static_cast<int>(threadIdx.x); p < part.num_pixels(); p += Memory::kThreads) {
    const int x = part.x_of(p), y = part.y_of(p);
    if (x >= part.x_end) continue;
    const Vec2 center = pixel_middle(x, y);
    FrontFace front;
    auto each = [&](auto&& take) {
      auto ask = [&](const ScreenFace& face) {
        if (x < face.box.x_begin || x >= face.box.x_end || y < face.box.y_begin || y >= face.box.y_end) return;
        if (covers_point(memory.edges + face.edge_begin, face.edge_count, center.x, center.y)) take(face);
      };
      if (has_room) {
        PICTURA_KEEP_LOOP
        for (Word at = memory.pixels[y - part.y_begin]; at != 0; at = memory.candidates[at - 1]) {
          ask(memory.faces[memory.rows[at - 1] >> Memory::kHalf]);
        }
      } else {
        PICTURA_KEEP_LOOP
        for (int i = 0; i < num_faces; ++i) ask(memory.faces[i]);
      }
    };
    each([&](const ScreenFace& face) { front.offer(face, center); });
    each([&](const ScreenFace& face) { front.offer_again(face, center); });
    const ScreenFace* face = front.front(center, [](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
    const int64_t at = view * plane + static_cast<int64_t>(y) * width + x;
    const float infinity = __uint_as_float(0x7F800000u);
    if (slot.depth_m) slot.depth_m[at] = face ? face_depth_m(*face, center) : infinity;
    if (slot.class_id) slot.class_id[at] = face ? face->class_id : uint8_t{0};
    if (slot.instance_id) slot.instance_id[at] = face ? instance_of(*face) : uint16_t{0};
  }
  reset_part(memory);
}

// Draws a part of the image that state->shown tells of. False where it has outgrown the block's memory.
template <typename Memory>
__device__ bool draw_image_part(const Memory& memory, const DrawTask& task, int32_t view, int32_t camera,
                                const Part& part) {
  const CameraSlot& slot = task.cameras[camera];
  const int width = width_px(slot.camera), num_faces = memory.state->shown.face_count;
  const ImageWriter writer{task.format, slot.color, view * slot.view_stride,
                           static_cast<int64_t>(width) * height_px(slot.camera), width};
  if (!draw_faces(memory, num_faces, part, NoVisit{}, writer)) return false;
  if (task.wants_planes) draw_planes<Memory>(slot, view, num_faces, part);
  return true;
}

__device__ inline void leave_to_last(const DrawTask& task, int32_t image) {
  task.overflow_images[atomicAdd(&task.counters->overflow, 1)] = image;
}

__device__ inline int32_t view_of(const DrawTask& task, int32_t image) {
  return task.first_view + image / num_cameras(task);
}
__device__ inline int32_t camera_of(const DrawTask& task, int32_t image) { return image % num_cameras(task); }

// Leaves an image for which the pool has no room until it is free again.
__device__ inline void postpone(const DrawTask& task, int32_t image) {
  task.postponed_images[atomicAdd(&task.counters->postponed, 1)] = image;
}

// The images that are drawn from the pool, by classes of how much they list.
__device__ inline int32_t* crowd_of(const DrawTask& task, int crowd) {
  return task.drawn_images + static_cast<int64_t>(crowd) * task.num_views * num_cameras(task);
}
__device__ inline void list_drawn(const DrawTask& task, int32_t image, int32_t listed) {
  const int crowd = min_of(listed / kCrowdFaces, kCrowds - 1);
  crowd_of(task, crowd)[atomicAdd(&task.counters->crowds[crowd], 1)] = image;
}
// Goes through them, the most crowded first.
class DrawOrder {
 public:
  __device__ explicit DrawOrder(const DrawTask& task) : task_(task) {}
  /// The image whose turn it is, no earlier than that of the call before; -1 after the last.
  __device__ int32_t image_of(int32_t turn) {
    const int32_t* crowds = task_.counters->crowds;
    PICTURA_KEEP_LOOP
    for (; crowd_ >= 0; --crowd_) {
      const int32_t count = crowds[crowd_];
      if (turn - begin_ < count) return crowd_of(task_, crowd_)[turn - begin_];
      begin_ += count;
    }
    return -1;
  }

 private:
  const DrawTask& task_;
  int crowd_ = kCrowds - 1;
  int32_t begin_ = 0;  // the first turn of the crowd
};

// Takes room for the faces of an image of which so many things may show, and lists it to be drawn. Its first batch, or
// -1 where it has to wait. One thread.
__device__ inline int32_t take_face_room(const DrawTask& task, int32_t image, int32_t listed) {
  BlockState* state = block_state();
  FaceMaking* making = &state->making;
  GatheredImage* out = task.pool.images + image;
  *out = {.face_count = kNotGathered};
  if (listed > kMostEntries) {
    leave_to_last(task, image);
    return -1;
  }
  DrawCounters* counters = task.counters;
  const int32_t face_begin = atomicAdd(&counters->faces, listed);
  if (face_begin + listed > task.pool.max_faces) {
    postpone(task, image);
    return -1;
  }
  const int32_t first_batch = atomicAdd(&counters->batches, FaceBatch::count_of(listed));
  list_drawn(task, image, listed);
  making->faces = task.pool.faces + face_begin;
  making->edges = task.pool.edges;
  making->num_faces = &out->face_count;
  making->num_clipped = &counters->clipped_edges;
  making->edge_begin = 4 * face_begin;
  making->clipped_begin = 4 * task.pool.max_faces;
  making->clipped_end = task.pool.max_edges;
  *out = image_of(*state, face_begin, 0);
  return first_batch;
}

// The entries of an image.
__device__ inline uint32_t* entries_of(const GatherLists& lists, int32_t image) {
  return lists.entries + static_cast<int64_t>(image) * lists.max_entries;
}

// Lists what images may show.
extern "C" __global__ void __launch_bounds__(kGatherThreads, kCullBlocksPerProcessor)
    pictura_cull(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  BlockState* state = block_state();
  CullRoom* room = &gather_room()->cull;
  DrawCounters* counters = task.counters;
  const int32_t num_images = task.num_views * num_cameras(task), num_blocks = static_cast<int32_t>(gridDim.x);
  PICTURA_KEEP_LOOP
  for (auto image = static_cast<int32_t>(blockIdx.x); image < num_images;
       image = num_blocks + next_of(&counters->next_culled)) {
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
    cull(state, task, room, &list);
    __syncwarp();
    list.finish();
    const int32_t listed = state->num_entries;
    find_occluders(&state->making, entries_of(task.pool.lists, image), min_of(listed, task.pool.lists.max_entries));
    int32_t first_batch = -1;
    if (lane_index() == 0) first_batch = take_face_room(task, image, listed);
    __syncwarp();
    copy_whole(task.pool.makings + image, state->making);
    first_batch = __shfl_sync(kAllLanes, first_batch, 0);
    const int32_t batches = first_batch >= 0 ? FaceBatch::count_of(listed) : 0;
    PICTURA_KEEP_LOOP
    for (int32_t batch = lane_index(); batch < batches; batch += kWarpSize) {
      task.pool.batches[first_batch + batch] = {image, batch * FaceBatch::kEntries};
    }
    __syncwarp();
  }
}

// Makes the faces that need no clipping, and lists the others.
extern "C" __global__ void __launch_bounds__(kGatherThreads, kMakingBlocksPerProcessor)
    pictura_gather(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  MakingState* state = making_state();
  DrawCounters* counters = task.counters;
  const int32_t num_batches = counters->batches, num_blocks = static_cast<int32_t>(gridDim.x);
  // They are much of a size, so they are dealt out. While the warp makes the faces of one, what the next one needs is
  // on its way, and where the next but one begins.
  auto i = static_cast<int32_t>(blockIdx.x);
  auto batch_at = [&](int32_t at) { return at < num_batches ? task.pool.batches[at] : FaceBatch{}; };
  FaceBatch next = batch_at(i), after = batch_at(i + num_blocks);
  int32_t turn = 0;
  uint32_t entry = kNoEntry;
  auto ask_for_next = [&] {
    entry = entries_of(task.pool.lists, next.image)[next.first_entry + lane_index()];
    copy_whole_later(&state->makings[turn], task.pool.makings[next.image]);
  };
  if (i < num_batches) ask_for_next();
  PICTURA_KEEP_LOOP
  for (; i < num_batches; i += num_blocks) {
    const FaceMaking& making = state->makings[turn];
    const int32_t image = next.image;
    const uint32_t its_entry = entry;
    wait_for_copies();
    __syncwarp();
    turn = 1 - turn;
    next = after;
    if (i + num_blocks < num_batches) ask_for_next();
    after = batch_at(i + 2 * num_blocks);
    make_faces(making, &state->room, task.pool.lists, &counters->listed, its_entry, image);
    __syncwarp();
  }
}

// Clips those, and makes lights.
extern "C" __global__ void __launch_bounds__(kGatherThreads, kClipBlocksPerProcessor)
    pictura_clip(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  ClipRoom* room = &gather_room()->clip;
  DrawCounters* counters = task.counters;
  const GatherCounts listed = counters->listed;
  // No more faces for a warp than it takes for all warps to have some: each is one long chain of instructions.
  const auto num_blocks = static_cast<int32_t>(gridDim.x);
  const int batch = clamp((listed.clipped + num_blocks - 1) / num_blocks, 1, kWarpSize);
  PICTURA_KEEP_LOOP
  for (auto i = static_cast<int32_t>(blockIdx.x);; i = num_blocks + next_of(&counters->next_clipped)) {
    const ClippedItem item = clipped_item(task.pool.lists, listed, i, batch);
    if (!item.is_any) return;
    if (!clip_things(task.pool.makings, room, item.is_one, item.are_lights, item.thing) &&
        atomicMin(&task.pool.images[item.thing.image].face_count, kNotGathered) >= 0) {
      postpone(task, item.thing.image);
    }
    __syncwarp();
  }
}

// A tile of a camera's images; without rows behind the last.
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
  // While the block draws a tile, a thread of the last warp, which has the fewest faces to look at, asks for the number
  // of the next but one, and what the next one shows.
  DrawOrder order(task);
  int32_t next_image = -1, after = 0;
  auto take_next = [&] {
    next_image = order.image_of(after / task.most_tiles);
    if (next_image < 0) return;
    state->upcoming_part = tile_of(task.cameras[camera_of(task, next_image)], after % task.most_tiles);
    after = atomicAdd(counter, 1);
    const GatheredImage* image = task.pool.images + next_image;
    for (size_t at = 0; at < sizeof(GatheredImage); at += sizeof(uint64_t)) {
      copy_into_shared(reinterpret_cast<char*>(&state->upcoming) + at, reinterpret_cast<const char*>(image) + at);
    }
  };
  const bool is_taker = static_cast<int>(threadIdx.x) == kDrawThreads - kWarpSize;
  if (is_taker) {
    after = atomicAdd(counter, 1);
    take_next();
  }
  reset_part(SmallDrawMemory::current());
  PICTURA_KEEP_LOOP
  for (;;) {
    if (is_taker) {
      wait_for_copies();
      state->image = next_image;
      state->part = state->upcoming_part;
      state->shown = state->upcoming;
      state->faces = task.pool.faces + state->shown.face_begin;
      state->edges = task.pool.edges;
    }
    sync_block();
    const int32_t image = state->image;
    const Part part = state->part;
    if (image < 0) return;
    if (is_taker) take_next();
    if (part.num_rows() > 0 && state->shown.face_count >= 0) {
      if (!draw_image_part(SmallDrawMemory::current(), task, view_of(task, image), camera_of(task, image), part) &&
          threadIdx.x == 0 && atomicExch(&task.pool.images[image].is_left_to_last, 1) == 0) {
        leave_to_last(task, image);
      }
    } else {
      sync_block();
    }
  }
}

// Draws an image whose faces the block gathers itself. False where there is no room for all of it, or where its view
// names something that does not exist. All threads of the block.
template <typename Memory>
__device__ bool gather_and_draw(const DrawTask& task, int32_t image, const GatherPlace& place) {
  const int32_t view = view_of(task, image), camera = camera_of(task, image);
  const PinholeCamera& shows = task.cameras[camera].camera;
  return gather(task, view, camera, place, true) &&
         each_tile(Memory::current(), width_px(shows), 0, height_px(shows), [&](const auto& memory, const Part& part) {
           return draw_image_part(memory, task, view, camera, part);
         });
}

// Shared memory of a block that draws what was postponed.
__host__ __device__ inline size_t postponed_bytes() {
  const size_t to_gather = gather_bytes(kDrawThreads), to_draw = draw_bytes();
  return to_gather > to_draw ? to_gather : to_draw;
}

// Draws the images for which the pool had no room: a block gathers one at a time where faces of others were.
extern "C" __global__ void __launch_bounds__(kDrawThreads, kPostponedBlocksPerProcessor)
    pictura_draw_postponed(const __grid_constant__ DrawTask task) {
  wait_for_earlier_launch();
  const int32_t count = task.counters->postponed;
  const auto block = static_cast<int32_t>(blockIdx.x), num_blocks = static_cast<int32_t>(gridDim.x);
  const FacePool& pool = task.pool;
  const int32_t clipped_edges = (pool.max_edges - 4 * pool.max_faces) / num_blocks;
  const int32_t clipped_begin = 4 * pool.max_faces + block * clipped_edges;
  const GatherPlace place{
      pool.faces + block * kMostEntries,
      pool.edges,
      4 * block * kMostEntries,
      clipped_begin,
      clipped_begin + clipped_edges,
      {entries_of(pool.lists, block), pool.lists.clipped + block * kMostEntries, kMostEntries, kMostEntries}};
  PICTURA_KEEP_LOOP
  for (int32_t i = block; i < count; i += num_blocks) {
    const int32_t image = task.postponed_images[i];
    if (!gather_and_draw<SmallDrawMemory>(task, image, place) && threadIdx.x == 0) leave_to_last(task, image);
  }
}

extern "C" __global__ void __launch_bounds__(kLargeThreads)
    pictura_draw_overflow(const __grid_constant__ DrawTask task, const __grid_constant__ Scratch scratch) {
  wait_for_earlier_launch();
  take_scratch(scratch);
  const BlockState* state = block_state();
  const int32_t count = task.counters->overflow;
  PICTURA_KEEP_LOOP
  for (int32_t i = static_cast<int32_t>(blockIdx.x); i < count; i += static_cast<int32_t>(gridDim.x)) {
    const int32_t image = task.overflow_images[i];
    const bool is_drawn = gather_and_draw<LargeDrawMemory>(task, image, place_of(state->scratch));
    if (!is_drawn && threadIdx.x == 0) note_fault(task, view_of(task, image), FaultKind::no_room);
  }
  sync_block();
  if (threadIdx.x == 0 && atomicAdd(&task.counters->ended, 1) + 1 == static_cast<int32_t>(gridDim.x)) {
    *task.counters = {};
  }
}

/// Adds up what the faces of an agent weigh.
struct WeighAgent {
  static constexpr bool kWanted = true;
  uint32_t number;
  int64_t* sum;
  __device__ void operator()(const ScreenFace& face, float weight) const {
    if (face.number == number) *sum += SeenWeight::units_of(weight);
  }
};

/// Rows of an image.
struct RowRange {
  int y_begin, y_end;
};

// The rows in which a thing of the gathered image may show. Every thread finds them by itself.
__device__ inline RowRange rows_of(const BlockState& state, uint32_t number) {
  RowRange rows{state.making.setting.camera.height_px, 0};
  PICTURA_KEEP_LOOP
  for (int i = 0; i < state.num_faces; ++i) {
    const ScreenFace& face = state.faces[i];
    if (face.number != number || face.box.y_begin >= face.box.y_end) continue;
    rows.y_begin = min_of(rows.y_begin, int{face.box.y_begin});
    rows.y_end = max_of(rows.y_end, int{face.box.y_end});
  }
  return rows;
}

// Adds what a thing of the gathered image weighs, among all others and then without them, to each thread's sum of its
// own. False where there is no room for all of it. All threads of the block.
__device__ inline bool weigh(BlockState* state, uint32_t number, SeenWeight* sum_inout) {
  const RowRange rows = rows_of(*state, number);
  const int num_faces = state->num_faces;
  auto add_to = [&](int64_t* sum) {
    return each_tile(LargeDrawMemory::current(), state->making.setting.camera.width_px, rows.y_begin, rows.y_end,
                     [&](const LargeDrawMemory& memory, const Part& part) {
                       return draw_faces(memory, num_faces, part, WeighAgent{number, sum}, NoImage{});
                     });
  };
  if (!add_to(&sum_inout->among_all)) return false;
  sync_block();
  PICTURA_KEEP_LOOP
  for (int i = static_cast<int>(threadIdx.x); i < num_faces; i += num_threads()) {
    if (state->faces[i].number != number) state->faces[i].box = PixelBox{};
  }
  sync_block();
  return add_to(&sum_inout->alone);
}

extern "C" __global__ void __launch_bounds__(kLargeThreads)
    pictura_visibility(const __grid_constant__ VisibilityTask task, const __grid_constant__ Scratch scratch) {
  wait_for_earlier_launch();
  take_scratch(scratch);
  BlockState* state = block_state();
  PICTURA_KEEP_LOOP
  for (int32_t q = static_cast<int32_t>(blockIdx.x); q < task.num_queries; q += static_cast<int32_t>(gridDim.x)) {
    const auto [view, agent] = task.queries[q];
    auto fault = [&](int32_t index, FaultKind kind) {
      if (threadIdx.x == 0) note_fault(task.draw, index, kind);
    };
    SeenWeight seen;
    const bool is_view = view >= 0 && view < task.draw.num_views;
    if (!is_view) fault(q, FaultKind::bad_query);
    PICTURA_KEEP_LOOP
    for (int32_t camera = 0; is_view && camera < num_cameras(task.draw); ++camera) {
      // What is hidden counts where the agent is alone. What is wrong with the view, set_view notes.
      if (!gather(task.draw, view, camera, place_of(state->scratch), false)) {
        if (state->usable != 0) fault(view, FaultKind::no_room);
        continue;
      }
      if (agent < state->view.world_begin || agent >= state->view.world_end) {
        fault(q, FaultKind::bad_query);
        break;
      }
      if (!weigh(state, thing_number(kAgentKind, agent - state->view.world_begin), &seen)) {
        fault(view, FaultKind::no_room);
      }
    }
    // Nothing is drawn any more where drawing keeps its pixels.
    auto* of_thread = reinterpret_cast<int64_t*>(state->scratch.bytes);
    const SeenWeight all{block_sum(of_thread, seen.among_all), block_sum(of_thread, seen.alone)};
    if (threadIdx.x == 0) task.visibility[q] = all.share();
    sync_block();
  }
}

}  // namespace pictura::cuda
