// From a scene to the faces of one image: threads share out candidates, then faces.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_block.cuh"

namespace pictura::cuda {

// What shows, face by face: a kind, of agents which face, and an index.
constexpr int kFaceShift = 27;
constexpr uint32_t kFaceIndexMask = (1u << kFaceShift) - 1;

// Appends the entries of the threads, in their order: entry(k) for each k below count. All threads of the block.
template <typename Memory, typename Entry>
__device__ void append_visible(const Memory& memory, int32_t count, Entry&& entry) {
  int32_t total = 0;
  const int32_t first = memory.state->num_visible + sum_before(memory.state, count, &total);
  for (int32_t k = 0; k < count && first + k < memory.max_faces; ++k) memory.visible[first + k] = entry(k);
  __syncthreads();
  if (threadIdx.x == 0) memory.state->num_visible += total;
  __syncthreads();
}

// Appends the pieces of a grid that may show, in ascending order. All threads of the block.
template <typename Memory, typename MayShow>
__device__ void append_pieces(const Memory& memory, uint32_t kind, int32_t num_pieces, const GridView& grid,
                              const Aabb2& box, MayShow&& may_show_piece) {
  BlockState* state = memory.state;
  const int thread = static_cast<int>(threadIdx.x);
  if (num_pieces > memory.max_pieces) {
    state->overflow = 1;
    return;
  }
  const int32_t words = (num_pieces + 31) / 32;
  for (int w = thread; w < words; w += kThreads) memory.seen[w] = 0;
  const CellRange range = cells_of(grid, box);
  const int columns = range.x_end - range.x_begin;
  const int cells = columns * (range.y_end - range.y_begin);
  for (int first = 0; first < cells; first += kThreads) {
    // A cell for each thread, then a candidate for each thread.
    const int cell = first + thread;
    int32_t count = 0, begin = 0;
    if (cell < cells) {
      const int at = (range.y_begin + cell / columns) * grid.num_x + range.x_begin + cell % columns;
      begin = grid.begin[static_cast<size_t>(at)];
      count = grid.begin[static_cast<size_t>(at) + 1] - begin;
    }
    int32_t total = 0;
    state->firsts[thread] = static_cast<uint32_t>(sum_before(state, count, &total));
    state->jobs[thread].face = begin;
    __syncthreads();
    for (int32_t k = thread; k < total; k += kThreads) {
      const int owner = find_owner(state->firsts, kThreads, static_cast<uint32_t>(k));
      const int32_t piece = grid.items[static_cast<size_t>(state->jobs[owner].face + k) - state->firsts[owner]];
      if (may_show_piece(piece)) atomicOr(&memory.seen[piece >> 5], 1u << (piece & 31));
    }
    __syncthreads();
  }
  for (int32_t first = 0; first < words; first += kThreads) {
    const int32_t word = first + thread;
    uint32_t bits = word < words ? memory.seen[word] : 0;
    append_visible(memory, __popc(bits), [&](int32_t) {
      const int32_t piece = 32 * word + __ffs(static_cast<int>(bits)) - 1;
      bits &= bits - 1;
      return thing_number(kind, piece);
    });
  }
}

// Lists the faces that may show: of agents, lights, walls, then strips.
template <typename Memory>
__device__ void cull(const Memory& memory, const DrawTask& task) {
  BlockState* state = memory.state;
  const ViewState& view = state->view;
  const ImageSetting& setting = state->setting;
  const RasterGeometry& geometry = view.geometry->raster;
  const int thread = static_cast<int>(threadIdx.x);
  for (int32_t first = view.world_begin; first < view.world_end; first += kThreads) {
    const int32_t agent = first + thread;
    uint32_t faces = 0;
    if (agent < view.world_end) {
      const AgentBox box = task.scene.agents[static_cast<size_t>(agent)];
      if (may_show(box, setting.camera, setting.frustum) && !is_left_out(view.view, task.scene.hidden_agents, agent)) {
        for (int face = 0; face < kNumCuboidFaces; ++face) {
          if (faces_eye(box, face, setting.camera.position_m)) faces |= 1u << face;
        }
      }
    }
    append_visible(memory, __popc(faces), [&](int32_t) {
      const uint32_t face = static_cast<uint32_t>(__ffs(static_cast<int>(faces))) - 1;
      faces &= faces - 1;
      return thing_number(kAgentKind, agent - view.world_begin) | face << kFaceShift;
    });
  }
  const Span<const LightHead> heads = geometry.pieces.heads;
  const int num_heads = view.light_end > view.light_begin ? static_cast<int>(heads.size()) : 0;
  for (int first = 0; first < num_heads; first += kThreads) {
    const int head = first + thread;
    const bool shows = head < num_heads && may_show(heads[static_cast<size_t>(head)], setting.camera, setting.frustum);
    append_visible(memory, shows ? 1 : 0, [&](int32_t) { return thing_number(kLightKind, head); });
  }
  const float wall_far_m = far_of(geometry.longest_wall_m);
  append_pieces(memory, kWallKind, static_cast<int32_t>(geometry.pieces.walls.size()), geometry.pieces.wall_grid,
                frustum_ground_box(setting.camera, setting.frustum, wall_far_m), [&](int32_t wall) {
                  return may_show(geometry.pieces.walls[static_cast<size_t>(wall)], setting.camera, setting.frustum,
                                  wall_far_m);
                });
  const float strip_far_m = far_of(geometry.longest_strip_m);
  append_pieces(memory, kStripKind, static_cast<int32_t>(geometry.pieces.strips.size()), geometry.pieces.strip_grid,
                frustum_ground_box(setting.camera, setting.frustum, strip_far_m), [&](int32_t strip) {
                  const Ball ball = view.geometry->strip_balls[static_cast<size_t>(strip)];
                  return ball_in_frustum(setting.frustum, to_camera(setting.camera, ball.center_m), ball.radius_m,
                                         strip_far_m);
                });
  __syncthreads();
  if (thread == 0 && state->num_visible > memory.max_faces) state->overflow = 1;
  __syncthreads();
}

template <typename Memory>
struct BlockEdges {
  const Memory& memory;
  __device__ int32_t take(int count) {
    const int32_t begin = atomicAdd(&memory.state->num_edges, count);
    if (begin + count <= memory.max_edges) return begin;
    memory.state->overflow = 1;
    return -1;
  }
  __device__ PolygonEdge* at(int32_t index) { return memory.edges + index; }
};

// One copy of the code that clips and projects, whatever emits the face.
template <typename Memory>
__device__ __noinline__ bool project_face(const Memory& memory, FaceOwner owner, const Vec3* corners, int count,
                                          const FacePlane& plane, Rgb color, ScreenFace* face_out) {
  BlockEdges<Memory> edges{memory};
  return make_face(memory.state->setting, owner, corners, count, plane, color, edges, face_out);
}

// Makes the listed faces; those that cover nothing have an empty box.
template <typename Memory>
__device__ void make_faces(const Memory& memory, const DrawTask& task) {
  const ViewState& view = memory.state->view;
  const ImageSetting& setting = memory.state->setting;
  const StaticGeometryView& pieces = view.geometry->raster.pieces;
  for (int32_t i = static_cast<int32_t>(threadIdx.x); i < memory.state->num_visible; i += kThreads) {
    const uint32_t entry = memory.visible[i];
    const uint32_t kind = kind_of(entry);
    const auto index = static_cast<int32_t>(entry & kFaceIndexMask);
    FaceOwner owner;
    ScreenFace face;
    bool shows = false;
    auto emit = [&](const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
      shows = project_face(memory, owner, corners, count, plane, color, &face);
    };
    if (kind == kStripKind) {
      const Strip strip = pieces.strips[static_cast<size_t>(index)];
      owner = strip_owner(strip, index);
      strip_faces(strip, setting.camera, setting.line_floor_px, emit);
    } else if (kind == kAgentKind) {
      const AgentBox box = task.scene.agents[static_cast<size_t>(view.world_begin + index)];
      owner = agent_owner(box, index);
      cuboid_face(box, static_cast<int>(entry >> kFaceShift) & 7, setting.camera, setting.debug_palette, emit);
    } else if (kind == kWallKind) {
      owner = wall_owner(index);
      wall_faces(pieces.walls[static_cast<size_t>(index)], setting.camera, emit);
    } else {
      const LightHead head = pieces.heads[static_cast<size_t>(index)];
      const LightState state = task.scene.light_states[static_cast<size_t>(view.light_begin + head.signal)];
      owner = light_owner(index);
      light_faces(head, state, setting.camera, emit);
    }
    if (!shows) face.box = PixelBox{};
    memory.faces[i] = face;
  }
  __syncthreads();
}

// Gathers what an image shows. False where it has outgrown the block's memory, or its view names something that does
// not exist (then state->usable is 0). All threads of the block.
template <typename Memory>
__device__ bool prepare(const Memory& memory, const DrawTask& task, int32_t view, int32_t camera) {
  BlockState* state = memory.state;
  __syncthreads();
  if (threadIdx.x == 0) {
    state->num_visible = state->num_edges = 0;
    state->overflow = 0;
    state->usable = set_view(&state->view, task, view) ? 1 : 0;
    if (state->usable) {
      const PinholeCamera placed = place_camera(task.cameras[camera].camera, state->view.view);
      state->setting = {placed, make_frustum(placed), task.line_floor_px, task.debug_palette};
    }
  }
  __syncthreads();
  if (!state->usable) return false;
  cull(memory, task);
  if (state->overflow) return false;
  make_faces(memory, task);
  return !state->overflow;
}

}  // namespace pictura::cuda
