// Face set-up: from list entries (objects that may be visible) to faces on screen. Nearly all faces have four corners
// and need no clipping; one lane sets up such a face. Other faces are listed and clipped in batches.
#pragma once

#include "pictura/backend_cuda/renderer/clip.cuh"
#include "pictura/backend_cuda/renderer/cull.cuh"
#include "pictura/backend_cuda/renderer/rig.cuh"
#include "pictura/common/raster/clip.h"

namespace pictura::cuda {

/// Values that a lane loads or stores, as words of 16 bytes. One word of padding limits bank conflicts.
template <typename Value, int kValues = 1>
struct LaneRow {
  static constexpr int kWords = kValues * sizeof(Value) / sizeof(uint4), kRowsAtOnce = kWarpSize / kWords;
  Value values[kValues];
  uint4 padding;
  __device__ uint4* words() { return reinterpret_cast<uint4*>(values); }
};
using StripRow = LaneRow<Strip>;
using EdgeRow = LaneRow<PolygonEdge, 4>;
using FaceRow = LaneRow<ScreenFace>;

/// Shared memory of a warp that sets up faces. The members are used in this order.
union FaceShared {
  StripRow strips[kWarpSize];
  EdgeRow edges[kWarpSize];
  FaceRow faces[kWarpSize];
};

union GeometryShared {
  CullShared cull;
  FaceShared faces;
  ClipShared clip;
};

/// Shared memory of a block. With 32 blocks, 28 KiB of the SM's 256 KiB remain for the L1 cache.
struct FaceSetupState {
  FaceSetupContext contexts[2];  // contexts of this batch and the next, alternating
  FaceShared storage;
};
__device__ inline FaceSetupState* face_setup_state() { return reinterpret_cast<FaceSetupState*>(block_memory); }

// Shared memory, in bytes, of a block that culls (cull_bytes) and of a block that runs all stages (setup_bytes).
__host__ __device__ constexpr size_t cull_bytes() { return state_bytes(kSetupThreads) + sizeof(CullShared); }
__host__ __device__ constexpr size_t setup_bytes(int threads) {
  return state_bytes(threads) + static_cast<size_t>(threads / kWarpSize) * sizeof(GeometryShared);
}
__device__ inline GeometryShared* geometry_shared() {
  return reinterpret_cast<GeometryShared*>(block_memory + state_bytes(num_threads())) + warp_index();
}

// Loads the strips among the lanes' entries. Four lanes load a strip together, so that each memory sector is requested
// once. Collective over the warp.
__device__ inline void load_strips(const FaceSetupContext& context, uint32_t entry, StripRow* rows_out) {
  const bool is_strip = kind_of(entry) == kStripKind;
  const unsigned strips = __ballot_sync(kAllLanes, is_strip);
  if (strips == 0) return;
  const uint32_t of_another = __shfl_sync(kAllLanes, entry, __ffs(static_cast<int>(strips)) - 1);
  const uint32_t index = (is_strip ? entry : of_another) & kFaceIndexMask;
  constexpr int kWords = StripRow::kWords, kRowsAtOnce = StripRow::kRowsAtOnce;
  const int row = lane_index() / kWords, word = lane_index() % kWords;
  uint4 words[kWords];
  for (int i = 0; i < kWords; ++i) {
    const uint32_t its_index = __shfl_sync(kAllLanes, index, kRowsAtOnce * i + row);
    words[i] = reinterpret_cast<const uint4*>(context.strips)[kWords * its_index + static_cast<uint32_t>(word)];
  }
  for (int i = 0; i < kWords; ++i) rows_out[kRowsAtOnce * i + row].words()[word] = words[i];
  __syncwarp();
}

// Makes the face of an entry that is not a light. Returns false if the face has faded to black.
template <typename StripOf>
__device__ bool make_quad(const FaceSetupContext& context, uint32_t entry, Quad* quad_out, StripOf&& strip_of) {
  const ImageSetting& setting = context.setting;
  const uint32_t kind = kind_of(entry);
  const auto index = static_cast<int32_t>(entry & kFaceIndexMask);
  // Only the corners are computed per kind, to limit divergence.
  WorldQuad world;
  quad_out->floor_px = 0.0f;
  if (kind == kStripKind) {
    const Strip strip = strip_of(index);
    quad_out->primitive = strip_ref(strip, index);
    quad_out->floor_px = setting.line_floor_px;
    world = strip_quad(strip);
  } else if (kind == kAgentKind) {
    const AgentBox box = context.agents[index];
    quad_out->primitive = agent_ref(box, index);
    world = cuboid_quad(box, static_cast<int>(entry >> kFaceShift) & 7, setting.debug_palette);
  } else {
    quad_out->primitive = wall_ref(index);
    world = wall_quad(context.walls[index]);
  }
  return quad_to_camera(world, setting.camera, &quad_out->in_camera);
}

__device__ inline void store_face(const FaceSetupContext& context, const ScreenFace& face, PrimitiveRef primitive,
                                  int32_t edge_begin, int32_t at) {
  if (at >= 0) store_words(context.faces + at, complete_face(face, primitive, edge_begin));
}

// Stores the first `count` rows contiguously, 512 bytes per warp at a time, to fill memory transactions.
template <typename Row>
__device__ void store_rows(uint4* to, Row* rows, int count) {
  constexpr int kWords = Row::kWords, kRowsAtOnce = Row::kRowsAtOnce;
  const int row = lane_index() / kWords, word = lane_index() % kWords, left = count - row;
  uint4* const own = to + lane_index();
  // Four words are read before they are stored, so that their latencies overlap.
  constexpr int kAtOnce = 4;
  for (int first = 0; first < kWords; first += kAtOnce) {
    uint4 words[kAtOnce];
    for (int i = 0; i < kAtOnce; ++i) words[i] = rows[row + kRowsAtOnce * (first + i)].words()[word];
    for (int i = 0; i < kAtOnce; ++i) {
      if (kRowsAtOnce * (first + i) < left) own[kWarpSize * (first + i)] = words[i];
    }
  }
}

// Sets up the faces of a batch, one entry per lane, and lists faces that need clipping. Collective over the warp.
__device__ inline void make_faces(const FaceSetupContext& context, FaceShared* storage, const SetupLists& lists,
                                  SetupCounts* counts, uint32_t entry, int32_t image) {
  const bool is_light = entry != kNoEntry && kind_of(entry) == kLightKind, is_quad = entry != kNoEntry && !is_light;
  if (__any_sync(kAllLanes, is_light)) {
    const int32_t at = warp_allocate_one(&counts->lights, is_light);
    if (is_light) lists.clipped[lists.max_clipped - 1 - at] = {entry, image};
  }
  const unsigned quads = __ballot_sync(kAllLanes, is_quad);
  if (quads == 0) return;
  // Lanes without a face compute another lane's face, so that the warp does not diverge.
  const uint32_t of_another = __shfl_sync(kAllLanes, entry, __ffs(static_cast<int>(quads)) - 1);
  const PinholeCamera& camera = context.setting.camera;
  Quad quad;
  const uint32_t made = is_quad ? entry : of_another;
  load_strips(context, made, storage->strips);
  const bool is_not_black =
      make_quad(context, made, &quad, [&](int32_t) { return storage->strips[lane_index()].values[0]; });
  ScreenQuad on_screen;
  bool is_clockwise = false;
  const ClipClass clip_class = project_quad(camera, quad.in_camera.corner, quad.floor_px, &on_screen);
  const bool passes_culling = is_quad_visible(context.setting, on_screen, quad.in_camera.plane, quad.in_camera.color,
                                              quad.primitive, &is_clockwise),
             is_wanted = is_quad && is_not_black;
  const bool is_visible = is_wanted && clip_class == ClipClass::inside && passes_culling,
             is_clipped = is_wanted && clip_class == ClipClass::crossing;
  // Lane 0 allocates the warp's faces; lane 1 allocates its clipped entries.
  const unsigned visible = __ballot_sync(kAllLanes, is_visible), clipped = __ballot_sync(kAllLanes, is_clipped);
  const int lane = lane_index(), wanted = __popc(lane == 0 ? visible : (lane == 1 ? clipped : 0u));
  int32_t taken = 0;
  if (wanted > 0) taken = atomicAdd(lane == 0 ? context.num_faces : &counts->clipped, wanted);
  const int rank = __popc(visible & lanes_below()), count = __popc(visible);
  __syncwarp();  // edges overwrite the strips
  ScreenFace face;
  if (is_visible) {
    PolygonEdge* const edges = storage->edges[rank].values;
    auto store_edge = [edges](int k, const PolygonEdge& edge) { store_words(edges + k, edge); };
    make_quad_face(camera, context.setting.frustum, on_screen, is_clockwise, quad.in_camera.plane, quad.in_camera.color,
                   store_edge, &face);
  }
  __syncwarp();
  const int32_t at = __shfl_sync(kAllLanes, taken, 0), clipped_at = __shfl_sync(kAllLanes, taken, 1);
  if (is_clipped) lists.clipped[clipped_at + __popc(clipped & lanes_below())] = {entry, image};
  const int32_t edge_begin = context.edge_begin + 4 * at;
  store_rows(reinterpret_cast<uint4*>(context.edges + edge_begin), storage->edges, count);
  __syncwarp();
  if (is_visible) {
    store_words(storage->faces[rank].values, complete_face(face, quad.primitive, edge_begin + 4 * rank));
  }
  __syncwarp();
  store_rows(reinterpret_cast<uint4*>(context.faces + at), storage->faces, count);
}

// Sets up a face with one corner per lane. Returns false if its edges do not fit into memory. Collective over the warp.
__device__ inline bool make_warp_face(const FaceSetupContext& context, ClipShared* storage, WarpFace warp_face) {
  clip(context.setting.frustum, storage, &warp_face);
  if (warp_face.count == 0) return true;
  int32_t edge_begin = 0;
  if (lane_index() == 0) edge_begin = context.clipped_begin + atomicAdd(context.num_clipped, warp_face.count);
  edge_begin = __shfl_sync(kAllLanes, edge_begin, 0);
  if (edge_begin + warp_face.count > context.clipped_end) return false;
  ScreenFace face;
  const bool is_visible = make_screen_face(context, warp_face, edge_begin, &face);
  if (is_visible && lane_index() == 0)
    store_face(context, face, warp_face.primitive, edge_begin, atomicAdd(context.num_faces, 1));
  return true;
}

// Clips and sets up the faces of active lanes. A face with too many corners for a lane is left to the caller, in
// *quad_out; *has_too_many_corners_out is then true. Returns false in lanes whose edges do not fit. Collective over the
// warp.
__device__ inline bool clip_quads(const FaceSetupContext* contexts, ClipShared* storage, bool is_active,
                                  ClippedPrimitive primitive, Quad* quad_out, bool* has_too_many_corners_out) {
  const FaceSetupContext& context = contexts[primitive.image];
  const PinholeCamera& camera = context.setting.camera;
  const LaneCorners corners(storage);
  Quad& quad = *quad_out;
  int kept = 0;
  auto strip_of = [&](int32_t index) { return context.strips[index]; };
  if (is_active && make_quad(context, primitive.entry, &quad, strip_of)) {
    const Frustum frustum = context.setting.frustum;
    const int count =
        widen_in_front(camera, quad.floor_px, quad.in_camera.corner, [corners](int i, Vec3 p) { corners.set(i, p); });
    kept = clip(frustum, planes_crossed(frustum, corners, count), count, corners);
  }
  ScreenBounds bounds;
  bool is_clockwise = false;
  const unsigned edges = kept > 0 ? project_in_place(camera, corners, kept, &bounds, &is_clockwise) : 0;
  const int count = __popc(edges), end = warp_inclusive_sum(count), total = __shfl_sync(kAllLanes, end, kWarpSize - 1);
  int32_t edge_begin = 0;
  if (lane_index() == 0 && total > 0) edge_begin = context.clipped_begin + atomicAdd(context.num_clipped, total);
  edge_begin = __shfl_sync(kAllLanes, edge_begin, 0);
  int at = end - count;
  const bool fits = edges == 0 || edge_begin + end <= context.clipped_end;
  if (edges != 0 && fits) {
    ScreenFace face;
    face.edge_count = static_cast<uint8_t>(count);
    face.color = quad.in_camera.color;
    set_bounds(camera, context.setting.frustum, bounds, quad.in_camera.plane, &face);
    store_face(context, face, quad.primitive, edge_begin + at, atomicAdd(context.num_faces, 1));
  }
  PICTURA_NO_UNROLL
  for (unsigned left = edges; left != 0; left &= left - 1, ++at) {
    const int from = __ffs(static_cast<int>(left)) - 1;
    storage->edges[at] = LaneEdge{lane_index(), from, from + 1 < kept ? from + 1 : 0, is_clockwise}.packed();
  }
  __syncwarp();
  PICTURA_NO_UNROLL
  for (int i = lane_index(); i < min_of(total, context.clipped_end - edge_begin); i += kWarpSize) {
    const LaneEdge edge = LaneEdge::unpacked(storage->edges[i]);
    const Vec2 from{storage->x[edge.from][edge.lane], storage->y[edge.from][edge.lane]};
    const Vec2 to{storage->x[edge.to][edge.lane], storage->y[edge.to][edge.lane]};
    store_words(context.edges + edge_begin + i,
                make_edge(edge.is_clockwise ? from : to, edge.is_clockwise ? to : from));
  }
  __syncwarp();
  *has_too_many_corners_out = kept == kTooManyCorners;
  return fits;
}

// Clips the primitives of active lanes and sets up their faces. Either all primitives are lights, or none is a light.
// Returns false in lanes whose edges do not fit. Collective over the warp.
__device__ inline bool clip_primitives(const FaceSetupContext* contexts, ClipShared* storage, bool is_active,
                                       bool are_lights, ClippedPrimitive primitive) {
  Quad quad;
  bool fits = true, is_by_warp = is_active;
  if (!are_lights) fits = clip_quads(contexts, storage, is_active, primitive, &quad, &is_by_warp);
  PICTURA_NO_UNROLL
  for (unsigned pending = __ballot_sync(kAllLanes, is_by_warp); pending != 0; pending &= pending - 1) {
    const int owner = __ffs(static_cast<int>(pending)) - 1;
    const FaceSetupContext& its_context = contexts[__shfl_sync(kAllLanes, primitive.image, owner)];
    const int32_t index = index_of(__shfl_sync(kAllLanes, primitive.entry, owner));
    const bool is_stored = make_warp_face(
        its_context, storage,
        are_lights ? make_light(its_context, index) : broadcast_quad(its_context.setting.camera, storage, owner, quad));
    if (lane_index() == owner) fits = is_stored;
  }
  return fits;
}

// Clipping work for a warp: one light, or `batch` faces of four corners, one per lane. Lights come first because they
// take longest.
struct ClippedItem {
  bool exists, are_lights;
  bool is_active;  // this lane has a primitive
  ClippedPrimitive primitive;
};
__device__ inline ClippedItem clipped_item(const SetupLists& lists, const SetupCounts& listed, int item, int batch) {
  const bool are_lights = item < listed.lights;
  const int first = (item - listed.lights) * batch, quad = first + lane_index();
  if (!are_lights && first >= listed.clipped) return {};
  return {true, are_lights, are_lights ? lane_index() == 0 : lane_index() < batch && quad < listed.clipped,
          lists.clipped[are_lights ? lists.max_clipped - 1 - item : min_of(quad, listed.clipped - 1)]};
}

// Sets the context of an image except for its outputs. Returns false and records a fault if its view is invalid. Called
// by one thread.
__device__ inline bool set_image(BlockState* state, const DrawTask& task, int32_t view, int32_t camera) {
  if (!set_view(&state->view, task, view)) return false;
  FaceSetupContext* context = &state->context;
  const CameraSlot& slot = task.cameras[camera];
  const View& placed = state->view.view;
  if (kRandomizesCameras && task.randomization.moves_cameras()) {
    const PinholeCamera in_ego = randomized_camera(slot.camera, task.randomization, placed.key, camera);
    context->setting.camera = place_camera(in_ego, placed);
    context->setting.frustum = make_frustum(in_ego);
  } else {
    context->setting.camera = place_camera(slot.camera, placed);
    context->setting.frustum = slot.frustum;
  }
  context->setting.line_floor_px = task.line_floor_px;
  context->setting.debug_palette = task.debug_palette;
  context->setting.occluders.count = 0;
  const StaticGeometryView& pieces = state->view.geometry->pieces;
  context->strips = pieces.strips.data();
  context->walls = pieces.walls.data();
  context->heads = pieces.heads.data();
  context->agents = task.scene.agents.data() + state->view.world_begin;
  context->lights = task.scene.light_states.data() + state->view.light_begin;
  return true;
}

// Selects the faces of largest area as occluders. Lane i holds the entry and area of occluder i.
class BestOccluders {
 public:
  __device__ explicit BestOccluders(FaceSetupContext* context) : context_(context) {}

  /// Offers the face of each active lane's entry. Collective over the warp.
  __device__ void add(bool is_active, uint32_t entry) {
    const ImageSetting& setting = context_->setting;
    const FaceSetupContext* context = context_;
    Quad quad;
    Offered own{is_active ? entry : kNoEntry};
    if (is_active && make_quad(*context, entry, &quad, [context](int32_t i) { return context->strips[i]; })) {
      own.area_bits =
          __float_as_int(occluder_area_px2(setting.camera, quad.in_camera, &own.on_screen, &own.is_clockwise));
    }
    const Chosen chosen = choose(own);
    const int slot = insert(own, chosen);
    if (chosen.own) {
      context_->setting.occluders.occluder[slot] =
          make_occluder(setting.camera, setting.frustum, quad.in_camera.plane, own.on_screen, own.is_clockwise);
    }
  }

  /// Collective over the warp.
  __device__ int count() const { return __popc(__ballot_sync(kAllLanes, kept_area_bits_ != 0)); }

 private:
  struct Offered {
    uint32_t entry;
    int area_bits = 0;  // bits of the area, which sort like areas; 0: occludes nothing
    ScreenQuad on_screen;
    bool is_clockwise = false;
  };
  // Whether the lane's offered face and its held face are among the best.
  struct Chosen {
    bool own = false, kept = false;
  };

  __device__ Chosen choose(const Offered& own) const {
    Chosen chosen;
    int left = own.area_bits, kept_left = kept_area_bits_;
    PICTURA_NO_UNROLL
    for (int k = 0; k < Occluders::kMaxCount; ++k) {
      const int maximum = __reduce_max_sync(kAllLanes, max_of(left, kept_left));
      if (maximum == 0) break;
      const uint32_t its = left == maximum ? own.entry : kNoEntry, other = kept_left == maximum ? kept_ : kNoEntry;
      const uint32_t lowest = __reduce_min_sync(kAllLanes, its < other ? its : other);
      if (own.entry == lowest) {
        chosen.own = true;
        left = 0;
      }
      if (kept_ == lowest) {
        chosen.kept = true;
        kept_left = 0;
      }
    }
    return chosen;
  }

  // Puts the chosen offered faces into slots of held faces that were not chosen. Returns the lane's slot.
  __device__ int insert(const Offered& own, Chosen chosen) {
    unsigned slots = ~__ballot_sync(kAllLanes, chosen.kept) & ((1u << Occluders::kMaxCount) - 1);
    int slot = 0;
    PICTURA_NO_UNROLL
    for (unsigned added = __ballot_sync(kAllLanes, chosen.own); added != 0; added &= added - 1, slots &= slots - 1) {
      const int from = __ffs(static_cast<int>(added)) - 1, to = __ffs(static_cast<int>(slots)) - 1;
      const uint32_t entry = __shfl_sync(kAllLanes, own.entry, from);
      const int area_bits = __shfl_sync(kAllLanes, own.area_bits, from);
      if (lane_index() == from) slot = to;
      if (lane_index() == to) {
        kept_ = entry;
        kept_area_bits_ = area_bits;
      }
    }
    return slot;
  }

  FaceSetupContext* context_;
  uint32_t kept_ = kNoEntry;
  int kept_area_bits_ = 0;
};

// Finds the occluders among a list's solids. Collective over one warp.
__device__ inline void find_occluders(FaceSetupContext* context, const uint32_t* entries, int32_t count) {
  auto is_candidate = [&](uint32_t entry) {
    const PinholeCamera& camera = context->setting.camera;
    const uint32_t index = entry & kFaceIndexMask;
    if (entry == kNoEntry) return false;
    if (kind_of(entry) == kAgentKind) return may_occlude(context->agents[index], camera);
    return kind_of(entry) == kWallKind && may_occlude(context->walls[index], camera);
  };
  BestOccluders best(context);
  WarpQueue queue(&block_state()->warps[warp_index()].queue);
  PICTURA_NO_UNROLL
  for (int32_t first = 0;; first += kWarpSize) {
    const bool is_more = first < count;
    const uint32_t entry = first + lane_index() < count ? entries[first + lane_index()] : kNoEntry;
    queue.push(is_candidate(entry), entry, 0);
    if (queue.is_ready() || (!is_more && !queue.is_empty())) {
      const WarpQueue::Pair candidate = queue.take();
      best.add(candidate.is_valid, candidate.a);
    }
    if (!is_more) break;
  }
  const int found = best.count();
  if (lane_index() == 0) context->setting.occluders.count = found;
  __syncwarp();
}

__device__ inline PreparedImage image_of(const BlockState& state, int32_t face_begin, int32_t face_count) {
  return {state.view.geometry, state.context.agents, face_begin, face_count};
}

/// Memory in which a block sets up an image.
struct SetupTarget {
  ScreenFace* faces;
  PolygonEdge* edges;
  int32_t edge_begin, clipped_begin, clipped_end;
  SetupLists lists;
};

// Returns the block's scratch memory, which suffices for a whole world.
__device__ inline SetupTarget setup_target_of(const Scratch& scratch) {
  SetupTarget target{scratch.faces, scratch.edges, 0, 4 * scratch.max_faces, scratch.max_edges, {}};
  lay_out(&target.lists, scratch, scratch.bytes);
  return target;
}

// Culls, sets up and clips an image's faces in the block's memory. Returns false if they do not fit, or if the view is
// invalid. Collective over the block.
__device__ inline bool prepare_image(const DrawTask& task, int32_t view, int32_t camera, const SetupTarget& target,
                                     bool culls_occluded) {
  BlockState* state = block_state();
  GeometryShared* storage = geometry_shared();
  const SetupLists& lists = target.lists;
  sync_block();
  if (threadIdx.x == 0) {
    state->listed = {};
    state->num_entries = state->num_faces = state->num_clipped = state->overflow = 0;
    state->usable = set_image(state, task, view, camera) ? 1 : 0;
    FaceSetupContext* context = &state->context;
    context->faces = state->faces = target.faces;
    context->edges = state->edges = target.edges;
    context->num_faces = &state->num_faces;
    context->num_clipped = &state->num_clipped;
    context->edge_begin = target.edge_begin;
    context->clipped_begin = target.clipped_begin;
    context->clipped_end = target.clipped_end;
  }
  sync_block();
  if (state->usable == 0) return false;
  EntryList list(lists.entries, lists.max_entries, &state->num_entries);
  cull(state, task, &storage->cull, &list);
  sync_block();
  if (state->num_entries > lists.max_entries) return false;
  if (warp_index() == 0) {
    list.finish();
    if (culls_occluded) find_occluders(&state->context, lists.entries, state->num_entries);
  }
  sync_block();
  PICTURA_NO_UNROLL
  for (int i = warp_index(); i < FaceBatch::count_of(state->num_entries); i += num_warps()) {
    make_faces(state->context, &storage->faces, lists, &state->listed,
               lists.entries[i * FaceBatch::kEntries + lane_index()], 0);
    __syncwarp();
  }
  sync_block();
  PICTURA_NO_UNROLL
  for (int i = warp_index();; i += num_warps()) {
    const ClippedItem item = clipped_item(lists, state->listed, i, kWarpSize);
    if (!item.exists) break;
    if (!clip_primitives(&state->context, &storage->clip, item.is_active, item.are_lights, item.primitive))
      state->overflow = 1;
  }
  sync_block();
  if (threadIdx.x == 0) state->current = image_of(*state, 0, state->num_faces);
  sync_block();
  return state->overflow == 0;
}

}  // namespace pictura::cuda
