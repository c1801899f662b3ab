// From a scene to the faces of one image: warps share out candidates, then faces. Nearly all faces have four corners
// and need no clipping: those stay in registers; the others, and lights, are put aside and made together.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_memory.cuh"

namespace pictura::cuda {

// What shows, face by face: a kind, of agents which face, and an index.
constexpr int kFaceShift = 27;
constexpr uint32_t kFaceIndexMask = (1u << kFaceShift) - 1;

// Appends `count` entries of each lane: entry(k) for each k below count.
template <typename Memory, typename Entry>
__device__ void append_visible(const Memory& memory, int count, Entry&& entry) {
  const int32_t first = take_places(&memory.state->num_visible, count);
  PICTURA_KEEP_LOOP
  for (int k = 0; k < count && first + k < memory.max_visible; ++k) memory.visible[first + k] = entry(k);
}

// The outline on the ground of what a camera sees: its position and the far corners.
struct GroundOutline {
  Vec2 corner[5];
};
__device__ inline GroundOutline ground_outline(const PinholeCamera& camera, const Frustum& f, float far_m) {
  GroundOutline outline;
  outline.corner[0] = camera.position_m.xy();
  PICTURA_KEEP_LOOP
  for (int i = 0; i < 4; ++i) outline.corner[i + 1] = far_corner(camera, f, i, far_m).xy();
  return outline;
}

// The range in x of an outline's hull between two y; low > high where it does not reach there. Its corners'
// connections, all of them, have the range of the hull's.
struct RangeX {
  float low = 1e30f, high = -1e30f;
  __device__ void add(float x) {
    low = min_of(low, x);
    high = max_of(high, x);
  }
};
__device__ inline RangeX range_between(const GroundOutline& outline, float y_low, float y_high) {
  RangeX range;
  PICTURA_KEEP_LOOP
  for (int i = 1; i < 5; ++i) {
    PICTURA_KEEP_LOOP
    for (int j = 0; j < i; ++j) {
      const Vec2 a = outline.corner[i], b = outline.corner[j];
      if (max_of(a.y, b.y) < y_low || min_of(a.y, b.y) > y_high) continue;
      const float slope = a.y != b.y ? (b.x - a.x) / (b.y - a.y) : 0.0f;
      const float low = min_of(a.x, b.x), high = max_of(a.x, b.x);
      range.add(clamp(a.x + (clamp(a.y, y_low, y_high) - a.y) * slope, low, high));
      range.add(clamp(b.x + (clamp(b.y, y_low, y_high) - b.y) * slope, low, high));
    }
  }
  return range;
}

// Appends the pieces of a map of one kind that may show. All threads of the block; lanes look at the rows of the grid,
// whose candidates the warps share.
template <typename Memory>
__device__ __noinline__ void append_pieces(uint32_t kind, const PieceGrid& pieces, float far_m) {
  const Memory memory = Memory::current();
  BlockState* state = memory.state;
  const ImageSetting& setting = state->setting;
  const GridView& grid = pieces.cells;
  const GroundOutline outline = ground_outline(setting.camera, setting.frustum, far_m);
  float y_low = 1e30f, y_high = -1e30f;
  PICTURA_KEEP_LOOP
  for (const Vec2 corner : outline.corner) {
    y_low = min_of(y_low, corner.y);
    y_high = max_of(y_high, corner.y);
  }
  if (grid.items.empty()) return;
  const int row_begin = grid.cell_y(y_low - pieces.largest_radius_m);
  const int row_end = grid.cell_y(y_high + pieces.largest_radius_m) + 1;
  PICTURA_KEEP_LOOP
  for (int first_row = row_begin; first_row < row_end; first_row += kWarpSize) {
    const int row = first_row + lane_index();
    int begin = 0, count = 0;
    if (row < row_end) {
      const float row_low = grid.origin_m.y + grid.cell_m * static_cast<float>(row) - pieces.largest_radius_m;
      const RangeX range = range_between(outline, row_low, row_low + grid.cell_m + 2.0f * pieces.largest_radius_m);
      if (range.low <= range.high) {
        const int32_t* row_cells = grid.begin.data() + static_cast<ptrdiff_t>(row) * grid.num_x;
        begin = row_cells[grid.cell_x(range.low - pieces.largest_radius_m)];
        count = row_cells[grid.cell_x(range.high + pieces.largest_radius_m) + 1] - begin;
      }
    }
    share_out(
        &state->warps[warp_index()], count,
        [&](int owner, int k) {
          const int place = __shfl_sync(kAllLanes, begin, max_of(owner, 0)) + k;
          bool shows = false;
          if (owner >= 0) {
            const Ball ball = pieces.balls[static_cast<size_t>(place)];
            shows = ball_in_frustum(setting.frustum, to_camera(setting.camera, ball.center_m), ball.radius_m, far_m);
          }
          const int32_t at = take_place(&state->num_visible, shows);
          if (shows && at < memory.max_visible) {
            memory.visible[at] = thing_number(kind, grid.items[static_cast<size_t>(place)]);
          }
        },
        warp_index() * kWarpSize, num_threads());
  }
}

__device__ inline LightState light_state(const DrawTask& task, const ViewState& view, const LightHead& head) {
  return task.scene.light_states[static_cast<size_t>(view.light_begin + head.signal)];
}

// Lists the faces that may show. All threads of the block.
template <typename Memory>
__device__ void cull(const Memory& memory, const DrawTask& task) {
  BlockState* state = memory.state;
  const ViewState& view = state->view;
  const ImageSetting& setting = state->setting;
  const RasterGeometry& geometry = view.geometry->raster;
  PICTURA_KEEP_LOOP
  for (int32_t first = view.world_begin + warp_index() * kWarpSize; first < view.world_end; first += num_threads()) {
    const int32_t agent = first + lane_index();
    uint32_t faces = 0;
    if (agent < view.world_end) {
      const AgentBox box = task.scene.agents[static_cast<size_t>(agent)];
      if (may_show(box, setting.camera, setting.frustum) && !is_left_out(view.view, task.scene.hidden_agents, agent)) {
        PICTURA_KEEP_LOOP
        for (int face = 0; face < kNumCuboidFaces; ++face) {
          if (faces_eye(box, face, setting.camera.position_m)) faces |= 1u << face;
        }
      }
    }
    append_visible(memory, __popc(faces), [&](int) {
      const uint32_t face = static_cast<uint32_t>(__ffs(static_cast<int>(faces))) - 1;
      faces &= faces - 1;
      return thing_number(kAgentKind, agent - view.world_begin) | face << kFaceShift;
    });
  }
  const Span<const LightHead> heads = geometry.pieces.heads;
  const int num_heads = view.light_end > view.light_begin ? static_cast<int>(heads.size()) : 0;
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < num_heads; first += num_threads()) {
    const int head = first + lane_index();
    bool shows = false;
    if (head < num_heads) {
      const LightHead light = heads[static_cast<size_t>(head)];
      shows = may_show(light, setting.camera, setting.frustum) &&
              light_is_visible(light, light_state(task, view, light), setting.camera.position_m);
    }
    const int32_t at = take_place(&state->num_lights, shows);
    if (shows && at < memory.max_lights) memory.lights[at] = static_cast<uint32_t>(head);
  }
  append_pieces<Memory>(kWallKind, view.geometry->walls, far_of(geometry.longest_wall_m));
  append_pieces<Memory>(kStripKind, view.geometry->strips, far_of(geometry.longest_strip_m));
}

// Room for so many more edges. One thread of the block.
template <typename Memory>
__device__ bool take_edge_room(const Memory& memory, const DrawTask& task, int count) {
  if constexpr (Memory::kUsesPool) {
    memory.state->num_edges = atomicAdd(&task.counters->rounds[task.round_index].edges, count);
    memory.state->max_edges = memory.state->num_edges + count;
    memory.state->pool_is_full = memory.state->max_edges > task.pool.max_edges ? 1 : 0;
    return memory.state->pool_is_full == 0;
  }
  return true;
}

// Room for the faces of all that is listed, and for edges of those that need no clipping. False where the pool has too
// little left. One thread of the block.
template <typename Memory>
__device__ bool take_face_room(const Memory& memory, const DrawTask& task) {
  BlockState* state = memory.state;
  state->num_faces = state->num_edges = 0;
  if constexpr (!Memory::kUsesPool) {
    state->faces = state->scratch.faces;
    state->edges = state->scratch.edges;
    state->max_faces = state->scratch.max_faces;
    state->max_edges = state->scratch.max_edges;
    return true;
  } else {
    const FacePool& pool = task.pool;
    state->max_faces = state->num_visible + state->num_lights;
    const int32_t face_begin = atomicAdd(&task.counters->rounds[task.round_index].faces, state->max_faces);
    state->faces = pool.faces + face_begin;
    state->edges = pool.edges;
    state->pool_is_full = face_begin + state->max_faces > pool.max_faces ? 1 : 0;
    return state->pool_is_full == 0 && take_edge_room(memory, task, 4 * state->num_visible);
  }
}

// Stores a value by words of 16 bytes: by words of 4, the lanes of a warp would write a part of memory each.
template <typename Value>
__device__ void store_whole(Value* to, const Value& value) {
  static_assert(sizeof(Value) % sizeof(uint4) == 0 && alignof(Value) >= sizeof(uint4));
  constexpr int kWords = sizeof(Value) / sizeof(uint4);
  uint4 words[kWords];
  memcpy(words, &value, sizeof(Value));
  for (int i = 0; i < kWords; ++i) reinterpret_cast<uint4*>(to)[i] = words[i];
}

struct EdgeRoom {
  BlockState* state;
  __device__ int32_t take(int count) {
    const int32_t begin = atomicAdd(&state->num_edges, count);
    if (begin + count <= state->max_edges) return begin;
    state->overflow = 1;
    return -1;
  }
  __device__ void put(int32_t index, const PolygonEdge& edge) { store_whole(state->edges + index, edge); }
};

// One copy of the code that clips, for quads and lights.
__device__ __noinline__ inline bool clip_and_make(FaceOwner owner, const Vec3* corners, int count,
                                                  const FacePlane& plane, Rgb color, ScreenFace* face_out) {
  EdgeRoom edges{block_state()};
  return make_face(edges.state->setting, owner, corners, count, plane, color, edges, face_out);
}

// The face of an entry; false where it has faded to black.
__device__ inline bool make_quad(const BlockState& state, const DrawTask& task, uint32_t entry, Quad* quad_out) {
  const ImageSetting& setting = state.setting;
  const StaticGeometryView& pieces = state.view.geometry->raster.pieces;
  const uint32_t kind = kind_of(entry);
  const auto index = static_cast<int32_t>(entry & kFaceIndexMask);
  // One body for all kinds but for their corners: lanes of a warp have different ones.
  WorldQuad world;
  if (kind == kStripKind) {
    const Strip strip = pieces.strips[static_cast<size_t>(index)];
    quad_out->owner = strip_owner(strip, index);
    world = strip_quad(strip);
  } else if (kind == kAgentKind) {
    const AgentBox box = task.scene.agents[static_cast<size_t>(state.view.world_begin + index)];
    quad_out->owner = agent_owner(box, index);
    world = cuboid_quad(box, static_cast<int>(entry >> kFaceShift) & 7, setting.debug_palette);
  } else {
    quad_out->owner = wall_owner(index);
    world = wall_quad(pieces.walls[static_cast<size_t>(index)]);
  }
  bool shows = false;
  emit_quad(
      world, setting.camera,
      [&](Vec3* corners) { return kind != kStripKind || widen_strip(setting.camera, setting.line_floor_px, corners); },
      [&](const Vec3* corners, int, const FacePlane& plane, Rgb color) {
        for (int i = 0; i < 4; ++i) quad_out->corner[i] = corners[i];
        quad_out->plane = plane;
        quad_out->color = color;
        shows = true;
      });
  return shows;
}

// Keeps the faces of those lanes that have one; notes where there is no room.
__device__ inline void keep_face(BlockState* state, bool has_one, const ScreenFace& face) {
  const int32_t at = take_place(&state->num_faces, has_one);
  if (!has_one) return;
  if (at < state->max_faces) {
    store_whole(state->faces + at, face);
  } else {
    state->overflow = 1;
  }
}

// Makes the faces of what needs no clipping, and puts aside what does.
template <typename Memory>
__device__ void make_quads(const Memory& memory, const DrawTask& task) {
  BlockState* state = memory.state;
  const int num_visible = state->num_visible;
  EdgeRoom edges{state};
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < num_visible; first += num_threads()) {
    const int i = first + lane_index();
    Quad quad;
    bool shows = i < num_visible && make_quad(*state, task, memory.visible[i], &quad);
    const unsigned crossed = shows ? planes_crossed(state->setting.frustum, quad.corner, 4) : kOutside;
    const bool put_aside = crossed != 0 && crossed != kOutside;
    shows = crossed == 0;
    const int32_t edge_begin = take_places(&state->num_edges, shows ? 4 : 0);
    if (shows && edge_begin + 4 > state->max_edges) {
      state->overflow = 1;
      shows = false;
    }
    ScreenFace face;
    auto keep_edge = [&](int k, const PolygonEdge& edge) { edges.put(edge_begin + k, edge); };
    shows =
        shows && make_screen_face<4>(state->setting.camera, quad.corner, 4, quad.plane, quad.color, keep_edge, &face);
    face.edge_begin = edge_begin;
    face.number = quad.owner.number;
    face.class_id = quad.owner.class_id;
    keep_face(state, shows, face);
    const int32_t at = take_place(&state->num_quads, put_aside);
    if (put_aside && at < memory.max_quads) store_whole(memory.quads + at, quad);
  }
}

// Makes the faces of all that shows. All threads of the block.
template <typename Memory>
__device__ void make_faces(const Memory& memory, const DrawTask& task) {
  BlockState* state = memory.state;
  make_quads(memory, task);
  sync_block();
  if (state->num_quads > memory.max_quads) {
    state->overflow = 1;
    return;
  }
  // A face of four corners has at most nine when clipped.
  if (threadIdx.x == 0 &&
      !take_edge_room(memory, task, 9 * state->num_quads + kMaxPolygonCorners * state->num_lights)) {
    state->overflow = 1;
  }
  sync_block();
  if (state->overflow != 0) return;
  const int num_quads = state->num_quads, num_rest = num_quads + state->num_lights;
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < num_rest; first += num_threads()) {
    const int i = first + lane_index();
    Vec3 corners[kMaxFaceCorners];
    int count = 0;
    FacePlane plane;
    Rgb color;
    FaceOwner owner;
    if (i < num_quads) {
      const Quad& quad = memory.quads[i];
      count = 4;
      PICTURA_KEEP_LOOP
      for (int k = 0; k < 4; ++k) corners[k] = quad.corner[k];
      plane = quad.plane;
      color = quad.color;
      owner = quad.owner;
    } else if (i < num_rest) {
      const auto index = static_cast<int32_t>(memory.lights[i - num_quads]);
      const LightHead head = state->view.geometry->raster.pieces.heads[static_cast<size_t>(index)];
      owner = light_owner(index);
      light_faces(head, light_state(task, state->view, head), state->setting.camera,
                  [&](const Vec3* of_light, int sides, const FacePlane& its_plane, Rgb its_color) {
                    count = sides;
                    PICTURA_KEEP_LOOP
                    for (int k = 0; k < sides; ++k) corners[k] = of_light[k];
                    plane = its_plane;
                    color = its_color;
                  });
    }
    ScreenFace face;
    const bool shows = count > 0 && clip_and_make(owner, corners, count, plane, color, &face);
    keep_face(state, shows, face);
  }
  sync_block();
}

// Gathers what an image shows, into state->shown too. False where it has outgrown the block's memory or the pool, or
// its view names something that does not exist (then state->usable is 0). All threads of the block.
template <typename Memory>
__device__ bool gather(const Memory& memory, const DrawTask& task, int32_t view, int32_t camera) {
  BlockState* state = memory.state;
  sync_block();
  if (threadIdx.x == 0) {
    state->num_visible = state->num_quads = state->num_lights = state->overflow = state->pool_is_full = 0;
    state->usable = set_view(&state->view, task, view) ? 1 : 0;
    if (state->usable) {
      const PinholeCamera placed = place_camera(task.cameras[camera].camera, state->view.view);
      state->setting = {placed, make_frustum(placed), task.line_floor_px, task.debug_palette};
    }
  }
  sync_block();
  if (!state->usable) return false;
  cull(memory, task);
  sync_block();
  if (state->num_visible > memory.max_visible || state->num_lights > memory.max_lights) return false;
  if (threadIdx.x == 0 && !take_face_room(memory, task)) state->overflow = 1;
  sync_block();
  if (state->overflow != 0) return false;
  make_faces(memory, task);
  sync_block();
  if (threadIdx.x == 0) {
    const PinholeCamera& camera_here = state->setting.camera;
    const auto face_begin = static_cast<int32_t>(Memory::kUsesPool ? state->faces - task.pool.faces : 0);
    state->shown = {face_begin,           state->num_faces,
                    camera_here.width_px, camera_here.position_m,
                    state->view.geometry, task.scene.agents.data() + state->view.world_begin};
  }
  sync_block();
  return state->overflow == 0;
}

}  // namespace pictura::cuda
