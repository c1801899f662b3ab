// Arguments of the drawing kernels. Three launches (cull, set up, clip) prepare the faces of all images in a memory
// pool. The fourth draws these images, one block per tile. The fifth draws deferred images, which did not fit into the
// pool, one block per image. The last (overflow) draws images that exceed a block's memory, in few blocks with memory
// for a whole world.
#pragma once

#include "pictura/common/patches.h"
#include "pictura/common/raster/face_setup.h"
#include "pictura/common/raster/randomize_camera.h"

namespace pictura::cuda {

/// Buckets of images by number of entries (objects that may be visible). Expensive buckets are drawn first.
constexpr int kNumCostBuckets = 16, kFacesPerCostBucket = 64;

/// Neighbouring pixels of a row that a thread writes with one store.
constexpr int kPixelsPerWrite = 4;

/// Maximum tile size. Tiles are higher than wide because distant primitives lie along the horizon.
constexpr int kTileWidth_px = 48, kNarrowTile_px = 32, kTileHeight_px = 54;
/// Tiles of an image: equally wide, except for the last column.
struct TileGrid {
  int tile_width_px = 0, across = 0, down = 0;
  PICTURA_HD constexpr int count() const { return across * down; }
};
PICTURA_HD constexpr TileGrid tiles_of(int max_px, int width_px, int height_px) {
  auto parts_of = [](int whole, int part) { return (whole + part - 1) / part; };
  const int together = kPixelsPerWrite * parts_of(parts_of(width_px, parts_of(width_px, max_px)), kPixelsPerWrite);
  return {together, parts_of(width_px, together), parts_of(height_px, kTileHeight_px)};
}

/// Outputs of one camera's optional planes. Null planes are not written.
struct CameraPlanes {
  float* depth_m = nullptr;
  uint8_t* class_id = nullptr;
  uint16_t* instance_id = nullptr;
  PICTURA_HD bool are_wanted() const { return depth_m || class_id || instance_id; }
};

/// A camera and its outputs; strides as in CameraImages.
struct CameraSlot {
  PinholeCamera camera;  // in the ego frame
  Frustum frustum;       // in camera coordinates
  TileGrid tiles;
  void* color = nullptr;
  int64_t view_stride = 0;
  CameraPlanes planes;
};

/// Bounding sphere of a piece.
struct alignas(16) Ball {
  Vec3 center_m;
  float radius_m = 0;
};

/// Grid of a map's strips or walls, by the centres of their spheres. Pieces of neighbouring cells of a row are
/// contiguous.
struct PieceGrid {
  GridView cells;
  Span<const Ball> balls;  // in the order of cells.items
  float largest_radius_m = 0;
};

/// A map's static geometry in device memory: an entry of GeometryTable.
struct DeviceGeometry {
  StaticGeometryView pieces;  // without its grids
  PieceGrid strips, walls;
  /// Returns false for a handle without a map.
  PICTURA_HD constexpr bool is_held() const { return pieces.num_signals >= 0; }
};
inline DeviceGeometry empty_entry() {
  DeviceGeometry entry;
  entry.pieces.num_signals = -1;
  return entry;
}

/// Kind of a fault. Kernels write a fault as one atomic word, and the host throws it at the next call.
enum class FaultKind : uint32_t {
  none,
  bad_world,
  bad_geometry,
  bad_pose,
  too_few_lights,
  too_many_agents,
  bad_query,
  capacity_exceeded,
  bad_view_count
};
struct Fault {
  FaultKind kind = FaultKind::none;
  int32_t index = 0;  // index of the view or the query, or number of views
};
using FaultWord = unsigned long long;
constexpr FaultWord kNoFault = 0;
PICTURA_HD constexpr FaultWord word_of(Fault fault) {
  return FaultWord{static_cast<uint32_t>(fault.kind)} << 32 | static_cast<uint32_t>(fault.index);
}
PICTURA_HD constexpr Fault fault_of(FaultWord word) {
  return {static_cast<FaultKind>(word >> 32), static_cast<int32_t>(static_cast<uint32_t>(word))};
}

/// Face count of an image outside the pool. Increments by other warps leave it negative.
constexpr int32_t kNotPrepared = -(1 << 30);

/// An image ready to be drawn. It is copied as words, so it has no padding.
struct PreparedImage {
  const DeviceGeometry* geometry = nullptr;
  const AgentBox* agents = nullptr;        // agents of its world
  int32_t face_begin = 0, face_count = 0;  // face_count may be kNotPrepared
  int32_t has_overflowed = 0;              // 1: exceeds a block's memory
  int32_t filler = 0;
};
static_assert(sizeof(PreparedImage) == 2 * sizeof(void*) + 4 * sizeof(int32_t));

struct alignas(16) Quad {
  CameraQuad in_camera;
  PrimitiveRef primitive;
  float floor_px;  // see CameraFace
};

/// Inputs and outputs of an image's face set-up. Each entry has space for a face and, at the matching index, four
/// edges. Images may share the range of clipped edges.
struct alignas(16) FaceSetupContext {
  ImageSetting setting;
  const Strip* strips = nullptr;
  const WallFace* walls = nullptr;
  const LightHead* heads = nullptr;
  const AgentBox* agents = nullptr;  // agents and lights of its world
  const LightState* lights = nullptr;
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  int32_t* num_faces = nullptr;    // faces written so far
  int32_t* num_clipped = nullptr;  // edges of clipped faces; may exceed their range
  int32_t edge_begin = 0;          // first edge of unclipped faces
  int32_t clipped_begin = 0, clipped_end = 0;
};

/// Maximum entries of an image that is drawn from the pool.
constexpr int kMaxEntries = 1536;

/// Batch of an image's entries. A warp sets up one entry per lane.
struct FaceBatch {
  static constexpr int kEntries = 32;
  /// The last batch may be partly filled.
  PICTURA_HD static constexpr int32_t count_of(int32_t entries) { return (entries + kEntries - 1) / kEntries; }
  int32_t image, first_entry;
};
/// An entry whose face must be clipped.
struct ClippedPrimitive {
  uint32_t entry;
  int32_t image;
};

/// Lists that each stage of face set-up passes to the next, with capacity for every visible entry.
struct SetupLists {
  uint32_t* entries = nullptr;          // [max_entries] per image, padded to whole batches
  ClippedPrimitive* clipped = nullptr;  // filled from both ends: faces at the front, lights at the back
  int32_t max_entries = 0, max_clipped = 0;
};
/// Lengths of SetupLists::clipped from its front and back.
struct SetupCounts {
  int32_t clipped = 0, lights = 0;
};

/// Faces of many images, and intermediate results of their set-up.
struct FacePool {
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  PreparedImage* images = nullptr;       // [images]
  FaceSetupContext* contexts = nullptr;  // [images]
  FaceBatch* batches = nullptr;          // enough for max_faces faces in these images
  SetupLists lists;
  int32_t max_faces = 0, max_edges = 0;  // max_edges: four per face, the rest for clipped faces
};

/// Returns how many blocks can set up one image each in the pool: 1 to max_blocks.
PICTURA_HD inline int setup_blocks(const FacePool& pool, int max_blocks) {
  return min_of(pool.max_faces / kMaxEntries, max_blocks);
}

/// Memory of the overflow launch's blocks, and the capacity of each block.
struct Scratch {
  ScreenFace* faces = nullptr;     // [blocks][max_faces]
  PolygonEdge* edges = nullptr;    // [blocks][max_edges]
  unsigned char* bytes = nullptr;  // [blocks][large_bytes()]
  int32_t blocks = 0, max_faces = 0, max_edges = 0;
};

/// Counters of a batch's launches: 0 before the first launch, reset by the last block.
struct DrawCounters {
  int32_t next_culled = 0, next_clipped = 0, next_drawn = 0;  // next_drawn counts tiles
  SetupCounts listed;
  int32_t faces = 0, batches = 0, clipped_edges = 0;  // allocated from the pool
  int32_t cost_buckets[kNumCostBuckets] = {};         // images drawn from the pool, by bucket
  int32_t deferred = 0;
  int32_t overflow = 0;
  int32_t finished_blocks = 0;  // blocks of the overflow launch
};

struct DrawTask {
  SceneBatch scene;                     // in device memory, as are the targets of all pointers below
  const View* views = nullptr;          // [max_views]
  const int32_t* view_count = nullptr;  // views to draw; null: all
  int32_t max_views = 0;
  int32_t first_view = 0;  // this launch draws views [first_view, first_view + num_views)
  int32_t num_views = 0, num_cameras = 0;
  int32_t max_tiles = 0;  // tiles of an image, maximum over cameras
  const DeviceGeometry* geometries = nullptr;
  int32_t num_geometries = 0;
  float line_floor_px = 0;
  bool debug_palette = false;
  CameraRandomization randomization;
  PixelFormat format = PixelFormat::u8;
  ChannelOrder order = ChannelOrder::planar;
  int32_t patch_px = kDefaultPatch_px;
  bool wants_planes = false;
  FaultWord* fault = nullptr;
  FacePool pool;
  DrawCounters* counters = nullptr;
  int32_t* deferred_images = nullptr;  // [images]
  int32_t* overflow_images = nullptr;  // [images]
  int32_t* drawn_images = nullptr;     // [kNumCostBuckets][images]
  CameraSlot cameras[kMaxCameras];
};

/// blocks: number of drawing blocks.
PICTURA_HD inline void choose_tiles(DrawTask* task, int blocks) {
  // Wide tiles keep all threads busy. With few tiles per block, narrow tiles balance the blocks better.
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
