// From entries that may show to faces. Nearly all have four corners and need no clipping: a lane makes one of those.
// Edges and faces take room by counters, so that nobody waits for others.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_cull.cuh"

namespace pictura::cuda {

/// Count of faces of an image that is not gathered; faces that are added meanwhile leave it negative.
constexpr int32_t kNotGathered = -(1 << 30);
/// A face of four corners has at most nine when clipped, if it is convex.
constexpr int kClippedQuadCorners = 9;

// The face of an entry that is no light; false where it has faded to black.
__device__ inline bool make_quad(const FaceMaking& making, uint32_t entry, Quad* quad_out) {
  const ImageSetting& setting = making.setting;
  const uint32_t kind = kind_of(entry);
  const auto index = static_cast<int32_t>(entry & kFaceIndexMask);
  // One body for all kinds but for their corners: lanes of a warp have different ones.
  WorldQuad world;
  if (kind == kStripKind) {
    const Strip strip = making.strips[index];
    quad_out->owner = strip_owner(strip, index);
    world = strip_quad(strip);
  } else if (kind == kAgentKind) {
    const AgentBox box = making.agents[index];
    quad_out->owner = agent_owner(box, index);
    world = cuboid_quad(box, static_cast<int>(entry >> kFaceShift) & 7, setting.debug_palette);
  } else {
    quad_out->owner = wall_owner(index);
    world = wall_quad(making.walls[index]);
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

// Keeps the faces of those lanes that have one.
__device__ inline void keep_face(const FaceMaking& making, bool has_one, const ScreenFace& face) {
  const int32_t at = take_place(making.num_faces, has_one);
  if (has_one && at >= 0 && at < making.max_faces) store_whole(making.faces + at, face);
}

/// Edges that a warp has taken room for.
class EdgeRun {
 public:
  __device__ EdgeRun(const FaceMaking& making, int32_t count) : making_(making) { take_room(count); }
  /// The place of so many edges, or -1: there is no room left.
  __device__ int32_t take(int32_t count) {
    if (next_ + count > end_) take_room(count);
    const int32_t begin = next_;
    next_ += count;
    return next_ <= making_.max_edges ? begin : -1;
  }

 private:
  __device__ void take_room(int32_t count) {
    if (lane_index() == 0) next_ = atomicAdd(making_.num_edges, count);
    next_ = __shfl_sync(kAllLanes, next_, 0);
    end_ = next_ + count;
  }
  const FaceMaking& making_;
  int32_t next_ = 0, end_ = 0;
};

// Makes the faces of a batch, an entry each lane. False where there is no room for all of them. All lanes of the warp.
__device__ inline bool make_faces(const FaceMaking& making, ClipRoom* room, uint32_t entry) {
  const bool is_light = entry != kNoEntry && kind_of(entry) == kLightKind;
  Quad quad;
  const bool is_quad = entry != kNoEntry && !is_light && make_quad(making, entry, &quad);
  const unsigned crossed = is_quad ? planes_crossed(making.setting.frustum, quad.corner, 4) : kOutside;
  const unsigned whole = __ballot_sync(kAllLanes, crossed == 0), lights = __ballot_sync(kAllLanes, is_light);
  const unsigned cut = __ballot_sync(kAllLanes, crossed != 0 && crossed != kOutside);
  if ((whole | lights | cut) == 0) return true;
  EdgeRun edges(making, 4 * __popc(whole) + kClippedQuadCorners * __popc(cut) + kMaxPolygonCorners * __popc(lights));
  const int32_t whole_begin = edges.take(4 * __popc(whole));
  if (whole_begin < 0) return false;
  PICTURA_KEEP_LOOP
  for (unsigned left = cut | lights; left != 0; left &= left - 1) {
    const int owner = __ffs(static_cast<int>(left)) - 1;
    SharedFace shared = (lights >> owner & 1) != 0
                            ? make_light(making, *room, index_of(__shfl_sync(kAllLanes, entry, owner)))
                            : share_quad(room, owner, quad);
    clip(making.setting.frustum, room, &shared);
    if (shared.count == 0) continue;
    const int32_t edge_begin = edges.take(shared.count);
    if (edge_begin < 0) return false;
    ScreenFace face;
    const bool shows = make_screen_face(making, shared, edge_begin, &face);
    keep_face(making, shows && lane_index() == 0, face);
  }
  ScreenFace face;
  face.edge_begin = whole_begin + 4 * __popc(whole & lanes_below());
  auto keep_edge = [&](int k, const PolygonEdge& edge) { store_whole(making.edges + face.edge_begin + k, edge); };
  const bool shows = crossed == 0 && make_screen_face<4>(making.setting.camera, quad.corner, 4, quad.plane, quad.color,
                                                         keep_edge, &face);
  face.number = quad.owner.number;
  face.class_id = quad.owner.class_id;
  keep_face(making, shows, face);
  return true;
}

// Sets what an image shows, but for where its faces go; false, with a fault noted, where its view names something that
// does not exist. One thread.
__device__ inline bool set_image(BlockState* state, const DrawTask& task, int32_t view, int32_t camera) {
  if (!set_view(&state->view, task, view)) return false;
  FaceMaking* making = &state->making;
  const PinholeCamera placed = place_camera(task.cameras[camera].camera, state->view.view);
  making->setting = {placed, make_frustum(placed), task.line_floor_px, task.debug_palette};
  const StaticGeometryView& pieces = state->view.geometry->raster.pieces;
  making->strips = pieces.strips.data();
  making->walls = pieces.walls.data();
  making->heads = pieces.heads.data();
  making->agents = task.scene.agents.data() + state->view.world_begin;
  making->lights = task.scene.light_states.data() + state->view.light_begin;
  return true;
}

// What drawing is told of an image.
__device__ inline GatheredImage image_of(const BlockState& state, int32_t face_begin, int32_t face_count) {
  const PinholeCamera& camera = state.making.setting.camera;
  return {face_begin, face_count, camera.width_px, camera.position_m, state.view.geometry, state.making.agents};
}

// Gathers an image into the block's own memory, all of it in one launch. False where there is no room for all, or where
// its view names something that does not exist. All threads of the block.
__device__ inline bool gather(const DrawTask& task, int32_t view, int32_t camera) {
  BlockState* state = block_state();
  GatherRoom* room = gather_room();
  const Scratch& scratch = state->scratch;
  sync_block();
  if (threadIdx.x == 0) {
    state->num_batches = state->num_faces = state->num_edges = state->overflow = 0;
    state->usable = set_image(state, task, view, camera) ? 1 : 0;
    FaceMaking* making = &state->making;
    making->faces = state->faces = scratch.faces;
    making->edges = state->edges = scratch.edges;
    making->num_faces = &state->num_faces;
    making->num_edges = &state->num_edges;
    making->max_faces = scratch.max_faces;
    making->max_edges = scratch.max_edges;
  }
  set_light_corners(&room->clip);
  sync_block();
  if (state->usable == 0) return false;
  auto* batches = reinterpret_cast<FaceBatch*>(scratch.bytes);
  EntryList list(room->entries, {batches, &state->num_batches, max_large_batches(scratch)}, 0);
  cull(state, task, room, &list);
  if (!list.is_whole()) state->overflow = 1;
  sync_block();
  if (state->overflow != 0) return false;
  PICTURA_KEEP_LOOP
  for (int i = warp_index(); i < state->num_batches; i += num_warps()) {
    if (!make_faces(state->making, &room->clip, batches[i].entries[lane_index()])) state->overflow = 1;
  }
  sync_block();
  if (threadIdx.x == 0) state->shown = image_of(*state, 0, state->num_faces);
  sync_block();
  return state->overflow == 0 && state->num_faces <= scratch.max_faces;
}

}  // namespace pictura::cuda
