// What the host tells the drawing kernels. Three launches gather the faces of images in a pool, the next draws them, a
// block a tile at a time; one more draws the images for which the pool had no room, a block an image at a time. What
// has outgrown a block's memory is left to a last launch of few blocks, whose memory has room for all that a world can
// hold.
#pragma once

#include "pictura/common/raster/face_setup.h"

namespace pictura::cuda {

/// Images are drawn in the order of how many faces they list, in classes of so many, the most crowded first: blocks
/// that come late to their last tile have a light one.
constexpr int kNumCostBuckets = 16, kFacesPerCostBucket = 64;

/// Pixels side by side that a thread writes together.
constexpr int kPixelsPerWrite = 4;

/// Images are drawn tile by tile, upright ones, because what is far away crowds along the horizon. Tiles are at most so
/// wide and high; narrower where there are few images, for blocks to end at about the same time.
constexpr int kTileWidth_px = 48, kNarrowTile_px = 32, kTileHeight_px = 54;
/// The tiles of an image that are at most so wide: as wide as each other, but for the last.
struct TileGrid {
  int tile_width_px = 0, across = 0, down = 0;
  PICTURA_HD constexpr int count() const { return across * down; }
};
PICTURA_HD constexpr TileGrid tiles_of(int max_px, int width_px, int height_px) {
  auto parts_of = [](int whole, int part) { return (whole + part - 1) / part; };
  const int together = kPixelsPerWrite * parts_of(parts_of(width_px, parts_of(width_px, max_px)), kPixelsPerWrite);
  return {together, parts_of(width_px, together), parts_of(height_px, kTileHeight_px)};
}

/// Where one camera's planes go; null: nowhere.
struct CameraPlanes {
  float* depth_m = nullptr;
  uint8_t* class_id = nullptr;
  uint16_t* instance_id = nullptr;
  PICTURA_HD bool are_wanted() const { return depth_m || class_id || instance_id; }
};

/// A camera, what follows from it, and where its images go; strides as in CameraImages.
struct CameraSlot {
  PinholeCamera camera;  // in the ego frame
  Frustum frustum;       // of the camera, wherever it is
  TileGrid tiles;        // see choose_tiles
  void* color = nullptr;
  int64_t view_stride = 0;
  CameraPlanes planes;
};

/// A piece's surroundings, for culling without a look at the piece itself.
struct alignas(16) Ball {
  Vec3 center_m;
  float radius_m = 0;
};

/// Pieces of a map of one kind, each in the cell of its ball's centre alone: no query meets one twice, and the pieces
/// of neighbouring cells of a row stand side by side.
struct PieceGrid {
  GridView cells;
  Span<const Ball> balls;  // as cells.items
  float largest_radius_m = 0;
};

/// A map's looks in device memory.
struct DeviceGeometry {
  StaticGeometryView pieces;  // without grids, which follow
  PieceGrid strips, walls;
};

/// What was wrong with a view or a query: written by the kernels, thrown by the next call. One word, so that the host
/// reads all of it or nothing.
enum class FaultKind : uint32_t {
  none,
  bad_world,
  bad_geometry,
  bad_pose,
  too_few_lights,
  too_many_agents,
  bad_query,
  capacity_exceeded
};
struct Fault {
  FaultKind kind = FaultKind::none;
  int32_t index = 0;  // of the view or the query
};
using FaultWord = unsigned long long;
constexpr FaultWord kNoFault = 0;
PICTURA_HD constexpr FaultWord word_of(Fault fault) {
  return FaultWord{static_cast<uint32_t>(fault.kind)} << 32 | static_cast<uint32_t>(fault.index);
}
PICTURA_HD constexpr Fault fault_of(FaultWord word) {
  return {static_cast<FaultKind>(word >> 32), static_cast<int32_t>(static_cast<uint32_t>(word))};
}

/// Count of faces of an image that is not gathered; faces that are added meanwhile leave it negative.
constexpr int32_t kNotPrepared = -(1 << 30);

/// What an image shows: its faces in a pool, and what tells which of them is in front. Copied whole, so it has no gaps.
struct PreparedImage {
  const DeviceGeometry* geometry = nullptr;
  const AgentBox* agents = nullptr;  // the first of its world
  Vec3 eye_m;
  int32_t face_begin = 0, face_count = 0;  // ... or kNotPrepared
  int32_t has_overflowed = 0;              // 1: to the last launch, when it was found too crowded
};
static_assert(sizeof(PreparedImage) == 2 * sizeof(void*) + 6 * sizeof(int32_t));

/// A face of four corners, and what it belongs to.
struct alignas(16) Quad {
  CameraQuad in_camera;
  PrimitiveRef primitive;
  float floor_px;  // see CameraFace
};

/// From what the faces of an image are made, and where they go. Each thing that may show has a place for a face and for
/// four edges, which stand where the face does; edges of what is clipped go to a part that many images may share.
struct alignas(16) FaceSetupContext {
  ImageSetting setting;
  const Strip* strips = nullptr;
  const WallFace* walls = nullptr;
  const LightHead* heads = nullptr;
  const AgentBox* agents = nullptr;  // of its world, like lights
  const LightState* lights = nullptr;
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  int32_t* num_faces = nullptr;    // that there are
  int32_t* num_clipped = nullptr;  // edges of clipped faces; may outgrow their part
  int32_t edge_begin = 0;          // four for each face
  int32_t clipped_begin = 0, clipped_end = 0;
};

/// Entries of an image that there is room for, if it is drawn from the pool.
constexpr int kMaxEntries = 1536;

/// Of the entries of an image (backend_cuda/renderer/cull.cuh) those that a warp makes faces of at once, one for each
/// lane.
struct FaceBatch {
  static constexpr int kEntries = 32;
  /// Of so many entries; the last one may not be full.
  PICTURA_HD static constexpr int32_t count_of(int32_t entries) { return (entries + kEntries - 1) / kEntries; }
  int32_t image, first_entry;
};
/// An entry that is to be clipped.
struct ClippedPrimitive {
  uint32_t entry;
  int32_t image;
};

/// What each step of gathering leaves to the next one. There is room to clip whatever may show.
struct SetupLists {
  uint32_t* entries = nullptr;          // [max_entries] for each image, whole batches of those that it has
  ClippedPrimitive* clipped = nullptr;  // faces of four corners from the front, lights from the back
  int32_t max_entries = 0, max_clipped = 0;
};
/// How much of what is to be clipped there is.
struct SetupCounts {
  int32_t clipped = 0, lights = 0;
};

/// Faces of many images, and what is known of those images before.
struct FacePool {
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  PreparedImage* images = nullptr;       // [images]
  FaceSetupContext* contexts = nullptr;  // [images]
  FaceBatch* batches = nullptr;          // as many as max_faces in so many images may make
  SetupLists lists;
  int32_t max_faces = 0, max_edges = 0;  // of edges, four for each face, the rest for those that are clipped
};

/// Of at most so many blocks, those that find room in a pool to gather an image each. A pool has room for one.
PICTURA_HD inline int setup_blocks(const FacePool& pool, int max_blocks) {
  return min_of(pool.max_faces / kMaxEntries, max_blocks);
}

/// Memory of the blocks of the last launch, and how much each of them has.
struct Scratch {
  ScreenFace* faces = nullptr;     // [blocks][max_faces]
  PolygonEdge* edges = nullptr;    // [blocks][max_edges]
  unsigned char* bytes = nullptr;  // [blocks][large_bytes()]
  int32_t blocks = 0, max_faces = 0, max_edges = 0;
};

/// What the blocks of a batch's launches count together; 0 before, and again when the last block has ended.
struct DrawCounters {
  int32_t next_culled = 0, next_clipped = 0, next_drawn = 0;  // the last counts tiles
  SetupCounts listed;
  int32_t faces = 0, batches = 0, clipped_edges = 0;  // of the pool that are taken
  int32_t cost_buckets[kNumCostBuckets] = {};         // images that are drawn from it, by how much they list
  int32_t deferred = 0;                               // images for which it has no room
  int32_t overflow = 0;                               // ... that are left to the last launch
  int32_t finished_blocks = 0;                        // blocks of that
};

struct DrawTask {
  SceneBatch scene;  // in device memory, like all that follows
  const View* views = nullptr;
  int32_t first_view = 0;  // views [first_view, first_view + num_views) are drawn
  int32_t num_views = 0, num_cameras = 0;
  int32_t max_tiles = 0;  // of an image
  const DeviceGeometry* geometries = nullptr;
  int32_t num_geometries = 0;
  float line_floor_px = 0;
  bool debug_palette = false;
  PixelFormat format = PixelFormat::u8;
  bool wants_planes = false;
  FaultWord* fault = nullptr;
  FacePool pool;
  DrawCounters* counters = nullptr;
  int32_t* deferred_images = nullptr;  // [images]
  int32_t* overflow_images = nullptr;  // [images]
  int32_t* drawn_images = nullptr;     // [kNumCostBuckets][images]
  CameraSlot cameras[kMaxCameras];
};

/// Sets the tiles that so many blocks draw.
PICTURA_HD inline void choose_tiles(DrawTask* task, int blocks) {
  // Wide tiles keep all threads busy; of few, blocks that end early would wait for the others.
  constexpr int kTilesOfBlock = 12;
  const int images = task->num_views * task->num_cameras;
  constexpr int kWidths_px[] = {kTileWidth_px, kNarrowTile_px};
  for (const int max_px : kWidths_px) {
    task->max_tiles = 0;
    for (int i = 0; i < task->num_cameras; ++i) {
      CameraSlot& slot = task->cameras[i];
      slot.tiles = tiles_of(max_px, slot.camera.width_px, slot.camera.height_px);
      task->max_tiles = max_of(task->max_tiles, slot.tiles.count());
    }
    if (images * task->max_tiles >= kTilesOfBlock * blocks) return;
  }
}

struct VisibilityTask {
  DrawTask draw;
  const VisibilityQuery* queries = nullptr;
  int32_t num_queries = 0;
  float* visibility = nullptr;
};

}  // namespace pictura::cuda
