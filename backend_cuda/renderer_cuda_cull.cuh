// What an image may show: a warp looks at the rows of the map's grid, a lane a row, then at the balls of the pieces in
// them, a lane a piece. What is found is left in batches of as many entries as a warp has lanes.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_memory.cuh"

namespace pictura::cuda {

// An entry is a face that may show: a kind, of agents which face, and an index.
constexpr int kFaceShift = 27;
constexpr uint32_t kFaceIndexMask = (1u << kFaceShift) - 1, kNoEntry = ~0u;

/// The outline on the ground of what a camera sees, by its sides: dx_dy is 0 for level ones.
struct OutlineSide {
  Vec2 a, b;
  float dx_dy;
};
constexpr int kOutlineSides = 8;

/// What a warp that culls keeps in shared memory.
struct CullRoom {
  uint32_t entries[2 * kWarpSize];
  OutlineSide strips[kOutlineSides], walls[kOutlineSides];
};
static_assert(FaceBatch::kEntries == kWarpSize);

/// Entries that a warp finds, of one image. All its lanes call what follows.
class EntryList {
 public:
  __device__ EntryList(CullRoom* room, const GatherLists& lists, GatherCounts* counts, int32_t image)
      : entries_(room->entries), lists_(lists), counts_(counts), image_(image) {}
  __device__ void push(bool wanted, uint32_t entry) {
    const unsigned pushing = __ballot_sync(kAllLanes, wanted);
    if (wanted) entries_[waiting_ + __popc(pushing & lanes_below())] = entry;
    waiting_ += __popc(pushing);
    if (waiting_ >= kWarpSize) leave_batch(kWarpSize);
  }
  __device__ void finish() {
    if (waiting_ > 0) leave_batch(waiting_);
  }
  __device__ int total() const { return total_; }
  /// False where there was not room for all batches.
  __device__ bool is_whole() const { return is_whole_; }

 private:
  // The last `count` of those that wait.
  __device__ void leave_batch(int count) {
    __syncwarp();
    waiting_ -= count;
    const int32_t place = next_of(&counts_->batches);
    if (place < lists_.max_batches) {
      FaceBatch* batch = lists_.batches + place;
      batch->entries[lane_index()] = lane_index() < count ? entries_[waiting_ + lane_index()] : kNoEntry;
      if (lane_index() == 0) {
        batch->image = image_;
        batch->first = total_;
      }
    } else {
      is_whole_ = false;
    }
    total_ += count;
    __syncwarp();
  }

  uint32_t* entries_;
  const GatherLists& lists_;
  GatherCounts* counts_;
  int32_t image_;
  int waiting_ = 0, total_ = 0;
  bool is_whole_ = true;
};

// Sets the outlines for strips and walls, which are seen from differently far away. The hull of the eye and the far
// corners on the ground has no other sides than those of the pyramid: from the eye to the corners, and around them. All
// lanes of the warp, one a side.
__device__ inline void set_outlines(CullRoom* room, const ImageSetting& setting, const RasterGeometry& geometry) {
  const int side = lane_index() % kOutlineSides;
  const bool of_strips = lane_index() < kOutlineSides;
  if (lane_index() < 2 * kOutlineSides) {
    const float far_m = far_of(of_strips ? geometry.longest_strip_m : geometry.longest_wall_m);
    auto corner = [&](int i) { return far_corner(setting.camera, setting.frustum, i, far_m).xy(); };
    // Corners differ in their first bit along x, and in their second along y.
    const int along = side & 3, from = along < 2 ? 2 * along : along - 2, to = along < 2 ? from + 1 : from + 2;
    OutlineSide* out = (of_strips ? room->strips : room->walls) + side;
    out->a = side < 4 ? setting.camera.position_m.xy() : corner(from);
    out->b = corner(side < 4 ? side : to);
    out->dx_dy = out->a.y != out->b.y ? (out->b.x - out->a.x) / (out->b.y - out->a.y) : 0.0f;
  }
  __syncwarp();
}

// The range in x of an outline's hull between two y; low > high where it does not reach there.
struct RangeX {
  float low = 1e30f, high = -1e30f;
  __device__ void add(float x) {
    low = min_of(low, x);
    high = max_of(high, x);
  }
};
__device__ inline RangeX range_between(const OutlineSide* sides, float y_low, float y_high) {
  RangeX range;
  PICTURA_KEEP_LOOP
  for (int i = 0; i < kOutlineSides; ++i) {
    const OutlineSide side = sides[i];
    if (max_of(side.a.y, side.b.y) < y_low || min_of(side.a.y, side.b.y) > y_high) continue;
    const float low = min_of(side.a.x, side.b.x), high = max_of(side.a.x, side.b.x);
    range.add(clamp(side.a.x + (clamp(side.a.y, y_low, y_high) - side.a.y) * side.dx_dy, low, high));
    range.add(clamp(side.b.x + (clamp(side.b.y, y_low, y_high) - side.b.y) * side.dx_dy, low, high));
  }
  return range;
}

// The rows of a grid that an outline may touch.
struct GridRows {
  int begin = 0, end = 0;
};
__device__ inline GridRows rows_of(const PieceGrid& pieces, const OutlineSide* sides) {
  if (pieces.cells.items.empty()) return {};
  float y_low = 1e30f, y_high = -1e30f;
  PICTURA_KEEP_LOOP
  for (int i = 0; i < kOutlineSides; ++i) {
    y_low = min_of(y_low, sides[i].b.y);
    y_high = max_of(y_high, sides[i].b.y);
  }
  y_low = min_of(y_low, sides[0].a.y);
  y_high = max_of(y_high, sides[0].a.y);
  return {pieces.cells.cell_y(y_low - pieces.largest_radius_m),
          pieces.cells.cell_y(y_high + pieces.largest_radius_m) + 1};
}

// The pieces of a row that an outline may touch, which stand side by side.
struct PieceRange {
  int begin = 0, count = 0;
};
__device__ inline PieceRange pieces_of_row(const PieceGrid& pieces, const OutlineSide* sides, int row) {
  const GridView& grid = pieces.cells;
  const float radius_m = pieces.largest_radius_m;
  const float row_low = grid.origin_m.y + grid.cell_m * static_cast<float>(row) - radius_m;
  const RangeX range = range_between(sides, row_low, row_low + grid.cell_m + 2.0f * radius_m);
  if (range.low > range.high) return {};
  const int32_t* row_cells = grid.begin.data() + static_cast<ptrdiff_t>(row) * grid.num_x;
  const int begin = row_cells[grid.cell_x(range.low - radius_m)];
  return {begin, row_cells[grid.cell_x(range.high + radius_m) + 1] - begin};
}

// Lists the strips and walls that may show. Each warp of the block, for its part of the candidates.
__device__ inline void cull_pieces(BlockState* state, CullRoom* room, EntryList* list) {
  const ImageSetting& setting = state->making.setting;
  const DeviceGeometry& geometry = *state->view.geometry;
  set_outlines(room, setting, geometry.raster);
  const float strip_far_m = far_of(geometry.raster.longest_strip_m),
              wall_far_m = far_of(geometry.raster.longest_wall_m);
  const GridRows strip_rows = rows_of(geometry.strips, room->strips), wall_rows = rows_of(geometry.walls, room->walls);
  const int num_strip_rows = strip_rows.end - strip_rows.begin;
  const int num_rows = num_strip_rows + wall_rows.end - wall_rows.begin;
  PICTURA_KEEP_LOOP
  for (int first_row = 0; first_row < num_rows; first_row += kWarpSize) {
    const int row = first_row + lane_index();
    const int is_wall_row = row >= num_strip_rows;
    PieceRange range;
    if (row < num_rows) {
      range = pieces_of_row(is_wall_row ? geometry.walls : geometry.strips, is_wall_row ? room->walls : room->strips,
                            row + (is_wall_row ? wall_rows.begin - num_strip_rows : strip_rows.begin));
    }
    share_out(
        &state->warps[warp_index()], range.count,
        [&](int owner, int k) {
          const int place = __shfl_sync(kAllLanes, range.begin, max_of(owner, 0)) + k;
          const bool is_wall = __shfl_sync(kAllLanes, is_wall_row, max_of(owner, 0)) != 0;
          const PieceGrid& pieces = is_wall ? geometry.walls : geometry.strips;
          bool shows = false;
          uint32_t entry = kNoEntry;
          if (owner >= 0) {
            const Ball ball = pieces.balls[static_cast<size_t>(place)];
            shows = ball_in_frustum(setting.frustum, to_camera(setting.camera, ball.center_m), ball.radius_m,
                                    is_wall ? wall_far_m : strip_far_m);
            if (shows) {
              entry = thing_number(is_wall ? kWallKind : kStripKind, pieces.cells.items[static_cast<size_t>(place)]);
            }
          }
          list->push(shows, entry);
        },
        warp_index() * kWarpSize, num_threads());
  }
}

// Lists the faces of agents that may show. Each warp of the block, for its part.
__device__ inline void cull_agents(const BlockState& state, const DrawTask& task, EntryList* list) {
  const ViewState& view = state.view;
  const ImageSetting& setting = state.making.setting;
  PICTURA_KEEP_LOOP
  for (int32_t first = view.world_begin + warp_index() * kWarpSize; first < view.world_end; first += num_threads()) {
    const int32_t agent = first + lane_index();
    uint32_t faces = 0;
    if (agent < view.world_end) {
      const AgentBox box = task.scene.agents[static_cast<size_t>(agent)];
      if (may_show(box, setting.camera, setting.frustum) && !is_left_out(view.view, task.scene.hidden_agents, agent)) {
        faces = faces_to_eye(box, setting.camera.position_m);
      }
    }
    PICTURA_KEEP_LOOP
    for (; __any_sync(kAllLanes, faces != 0); faces &= faces - 1) {
      const uint32_t face = static_cast<uint32_t>(__ffs(static_cast<int>(faces))) - 1;
      list->push(faces != 0, thing_number(kAgentKind, agent - view.world_begin) | face << kFaceShift);
    }
  }
}

// ... the lit heads that are turned to the camera.
__device__ inline void cull_lights(const BlockState& state, EntryList* list) {
  const ImageSetting& setting = state.making.setting;
  const Span<const LightHead> heads = state.view.geometry->raster.pieces.heads;
  const int num_heads = state.view.light_end > state.view.light_begin ? static_cast<int>(heads.size()) : 0;
  PICTURA_KEEP_LOOP
  for (int first = warp_index() * kWarpSize; first < num_heads; first += num_threads()) {
    const int index = first + lane_index();
    bool shows = false;
    if (index < num_heads) {
      const LightHead head = heads[static_cast<size_t>(index)];
      shows = may_show(head, setting.camera, setting.frustum) &&
              light_is_visible(head, state.making.lights[head.signal], setting.camera.position_m);
    }
    list->push(shows, thing_number(kLightKind, index));
  }
}

// Lists all faces that an image may show. Each warp of the block, for its part.
__device__ inline void cull(BlockState* state, const DrawTask& task, CullRoom* room, EntryList* list) {
  cull_agents(*state, task, list);
  cull_lights(*state, list);
  cull_pieces(state, room, list);
  list->finish();
}

}  // namespace pictura::cuda
