// Culling: a warp tests the map's grid rows, one lane per row, then their pieces' bounding spheres, one lane per piece.
// Objects that may be visible become entries, in batches of warp size.
#pragma once

#include "pictura/backend_cuda/renderer/draw_memory.cuh"
#include "pictura/common/portable/intrinsics.h"

namespace pictura::cuda {

constexpr uint32_t kNoEntry = ~0u;

/// A side of the frustum's outline on the ground plane; a.y <= b.y.
struct alignas(16) OutlineSide {
  Vec2 a, b;
  float dx_dy;  // 0 for sides of constant y
  float x_low, x_high;
};
constexpr int kOutlineSides = 8;

/// Shared memory of a warp that culls.
struct CullShared {
  OutlineSide sides[kOutlineSides];
  // [0]: strips; [1]: walls.
  const Ball* balls[2];
  const int32_t* items[2];
  int32_t offsets[kWarpSize];  // offsets of non-empty rows, see cull_pieces
};
static_assert(FaceBatch::kEntries == kWarpSize);

/// Entries of an image. All lanes of a warp call the functions together.
class EntryList {
 public:
  /// count: number of pushed entries, in shared memory. It includes entries beyond max_entries, which are dropped.
  __device__ EntryList(uint32_t* entries, int32_t max_entries, int32_t* count)
      : entries_(entries), max_entries_(max_entries), count_(count) {}
  __device__ void push(bool wanted, uint32_t entry) {
    const int32_t index = warp_allocate_one(count_, wanted);
    if (wanted) set(index, entry);
  }
  /// faces: bit mask of an agent's faces.
  __device__ void push_faces(unsigned faces, uint32_t object_id) {
    const int count = __popc(faces), end = warp_inclusive_sum(count);
    int32_t index = warp_allocate(count_, end) + end - count;
    PICTURA_NO_UNROLL
    for (; faces != 0; faces &= faces - 1) {
      set(index++, face_entry(object_id, __ffs(static_cast<int>(faces)) - 1));
    }
  }
  /// Pads the last batch, after all warps have pushed.
  __device__ void finish() {
    const int32_t count = *count_, end = FaceBatch::count_of(count) * FaceBatch::kEntries;
    if (count + lane_index() < end) set(count + lane_index(), kNoEntry);
  }

 private:
  __device__ void set(int32_t index, uint32_t entry) {
    if (index < max_entries_) entries_[index] = entry;
  }
  uint32_t* entries_;
  int32_t max_entries_;
  int32_t* count_;
};

__device__ inline const PieceGrid& pieces_of(const DeviceGeometry& geometry, int of_walls) {
  return of_walls != 0 ? geometry.walls : geometry.strips;
}

// Returns the row or column at a distance from the grid's origin. Rounding is harmless, because bounding spheres have a
// larger margin.
__device__ inline int cell_at(float distance_m, float cells_per_m, int count) {
  return clamp(static_cast<int>(floorf(distance_m * cells_per_m)), 0, count - 1);
}

// Grid rows that the outline may touch. [0]: strips; [1]: walls.
struct GridRows {
  int begin[2], count[2];
};

// Sets the outline's sides: four edges from the eye to the far corners, and four between far corners. They include all
// sides of the convex hull. Collective over the warp.
__device__ inline GridRows set_outline(CullShared* storage, const ImageSetting& setting,
                                       const DeviceGeometry& geometry) {
  const int side = lane_index() % kOutlineSides, of_walls = lane_index() / kOutlineSides & 1;
  const PieceGrid& pieces = pieces_of(geometry, of_walls);
  auto corner = [&](int i) { return far_corner(setting.camera, setting.frustum, i).xy(); };
  // Bit 0 of a corner's index selects x, bit 1 selects y.
  const int along = side & 3, from = along < 2 ? 2 * along : along - 2, to = along < 2 ? from + 1 : from + 2;
  const Vec2 first = side < 4 ? setting.camera.position_m.xy() : corner(from), second = corner(side < 4 ? side : to);
  const bool rises = first.y <= second.y;
  OutlineSide out;
  out.a = rises ? first : second;
  out.b = rises ? second : first;
  out.dx_dy = out.a.y != out.b.y ? (out.b.x - out.a.x) / (out.b.y - out.a.y) : 0.0f;
  out.x_low = min_no_nan(out.a.x, out.b.x);
  out.x_high = max_no_nan(out.a.x, out.b.x);
  if (lane_index() < kOutlineSides) storage->sides[side] = out;
  if (side == 0) {
    storage->balls[of_walls] = pieces.balls.data();
    storage->items[of_walls] = pieces.cells.items.data();
  }
  const GridView& grid = pieces.cells;
  const float cells_per_m = reciprocal_in_range(grid.cell_m), radius_m = pieces.largest_radius_m;
  const int low = cell_at(out.a.y - radius_m - grid.origin_m.y, cells_per_m, grid.num_y);
  const int high = cell_at(out.b.y + radius_m - grid.origin_m.y, cells_per_m, grid.num_y);
  const bool has_pieces = !grid.items.empty();
  GridRows rows;
  for (int i = 0; i < 2; ++i) {
    const bool is_valid = has_pieces && of_walls == i;
    rows.begin[i] = __reduce_min_sync(kAllLanes, is_valid ? low : 0x7FFFFFFF);
    rows.count[i] = max_of(__reduce_max_sync(kAllLanes, is_valid ? high + 1 : 0) - rows.begin[i], 0);
  }
  __syncwarp();
  return rows;
}

// Contiguous range of pieces of a row that the outline may touch.
struct PieceRange {
  int begin = 0, count = 0;
};
__device__ inline PieceRange pieces_of_row(const PieceGrid& pieces, const OutlineSide* sides, int row) {
  const GridView& grid = pieces.cells;
  const float radius_m = pieces.largest_radius_m;
  const float y_low = grid.origin_m.y + grid.cell_m * static_cast<float>(row) - radius_m;
  const float y_high = y_low + grid.cell_m + 2.0f * radius_m;
  // x range of the outline's convex hull within [y_low, y_high].
  float x_low = 1e30f, x_high = -1e30f;
  PICTURA_NO_UNROLL
  for (int i = 0; i < kOutlineSides; ++i) {
    const OutlineSide side = sides[i];
    const float enter = max_no_nan(side.a.y, y_low), leave = min_no_nan(side.b.y, y_high);
    auto within = [&](float x) { return min_no_nan(max_no_nan(x, side.x_low), side.x_high); };
    const float x_in = within(side.a.x + (enter - side.a.y) * side.dx_dy);
    const float x_out = within(side.b.x + (leave - side.b.y) * side.dx_dy);
    const bool is_between = enter <= leave;
    x_low = min_no_nan(x_low, is_between ? min_no_nan(x_in, x_out) : x_low);
    x_high = max_no_nan(x_high, is_between ? max_no_nan(x_in, x_out) : x_high);
  }
  if (x_low > x_high) return {};
  const float cells_per_m = reciprocal_in_range(grid.cell_m);
  const int32_t* row_cells = grid.begin.data() + static_cast<ptrdiff_t>(row) * grid.num_x;
  const int begin = row_cells[cell_at(x_low - radius_m - grid.origin_m.x, cells_per_m, grid.num_x)];
  return {begin, row_cells[cell_at(x_high + radius_m - grid.origin_m.x, cells_per_m, grid.num_x) + 1] - begin};
}

__device__ inline void cull_pieces(BlockState* state, CullShared* storage, EntryList* list) {
  const PinholeCamera& camera = state->context.setting.camera;
  const Frustum& frustum = state->context.setting.frustum;
  const DeviceGeometry& geometry = *state->view.geometry;
  const GridRows rows = set_outline(storage, state->context.setting, geometry);
  const int num_rows = rows.count[0] + rows.count[1], lane = lane_index();
  PICTURA_NO_UNROLL
  for (int first_row = 0; first_row < num_rows; first_row += kWarpSize) {
    const int row = first_row + lane;
    const int of_walls = row >= rows.count[0] ? 1 : 0;
    PieceRange range;
    if (row < num_rows) {
      range = pieces_of_row(pieces_of(geometry, of_walls), storage->sides,
                            of_walls != 0 ? row - rows.count[0] + rows.begin[1] : row + rows.begin[0]);
    }
    // Pieces of all rows are numbered consecutively, strips first. A piece's grid index is its number plus its row's
    // offset.
    const bool has_some = range.count > 0;
    const int end = warp_inclusive_sum(range.count), begin = end - range.count;
    const int total = __shfl_sync(kAllLanes, end, kWarpSize - 1);
    const unsigned owning = __ballot_sync(kAllLanes, has_some);
    const int num_of_strips = __popc(__ballot_sync(kAllLanes, has_some && of_walls == 0));
    if (has_some) storage->offsets[__popc(owning & lanes_below())] = range.begin - begin;
    __syncwarp();
    struct Candidate {
      Ball ball;
      int32_t index;
      int kind;  // index into CullShared::balls
    };
    auto candidate_of = [&](int item) {
      const int rank = owner_rank(item, begin, has_some);
      const int kind = rank >= num_of_strips ? 1 : 0;
      const int index = min_of(item + lane, total - 1) + storage->offsets[rank];
      return Candidate{storage->balls[kind][index], storage->items[kind][index], kind};
    };
    int item = warp_index() * kWarpSize;
    Candidate next;
    if (item < total) next = candidate_of(item);
    // Software prefetch of the next candidates.
    PICTURA_NO_UNROLL
    while (item < total) {
      const Candidate candidate = next;
      const bool is_valid = item + lane < total;
      item += num_threads();
      next = candidate_of(item);
      const bool is_visible =
          sphere_in_frustum(frustum, to_camera(camera, candidate.ball.center_m), candidate.ball.radius_m);
      list->push(is_visible && is_valid, make_object_id(candidate.kind != 0 ? kWallKind : kStripKind, candidate.index));
    }
    __syncwarp();
  }
}

__device__ inline void cull_agents(const BlockState& state, const DrawTask& task, EntryList* list) {
  const ViewState& view = state.view;
  const ImageSetting& setting = state.context.setting;
  PICTURA_NO_UNROLL
  for (int32_t first = view.world_begin + warp_index() * kWarpSize; first < view.world_end; first += num_threads()) {
    const int32_t agent = first + lane_index();
    uint32_t faces = 0;
    if (agent < view.world_end) {
      const AgentBox box = task.scene.agents[agent];
      if (may_be_visible(box, setting.camera, setting.frustum) &&
          !is_excluded(view.view, task.scene.hidden_agents, agent)) {
        faces = front_facing_mask(box, setting.camera.position_m);
      }
    }
    list->push_faces(faces, make_object_id(kAgentKind, agent - view.world_begin));
  }
}

__device__ inline void cull_lights(const BlockState& state, EntryList* list) {
  const ImageSetting& setting = state.context.setting;
  const Span<const LightHead> heads = state.view.geometry->pieces.heads;
  const bool has_lights = state.view.light_end > state.view.light_begin;
  const bool are_hidden = (state.view.view.hides & kHidesLights) != 0;
  const int num_heads = has_lights && !are_hidden ? static_cast<int>(heads.size()) : 0;
  PICTURA_NO_UNROLL
  for (int first = warp_index() * kWarpSize; first < num_heads; first += num_threads()) {
    const int index = first + lane_index();
    bool is_visible = false;
    if (index < num_heads) {
      const LightHead head = heads[index];
      is_visible = may_be_visible(head, setting.camera, setting.frustum) &&
                   light_is_visible(head, state.context.lights[head.signal], setting.camera.position_m);
    }
    list->push(is_visible, make_object_id(kLightKind, index));
  }
}

// Lists everything that may be visible in an image. Each warp of the block processes its share.
__device__ inline void cull(BlockState* state, const DrawTask& task, CullShared* storage, EntryList* list) {
  cull_agents(*state, task, list);
  cull_lights(*state, list);
  cull_pieces(state, storage, list);
}

}  // namespace pictura::cuda
