// What the host tells the drawing kernels. One launch gathers the faces of images in a pool, the next draws them, a
// block an image at a time; two more launches do the same with what the pool had no room for, and so on. What has
// outgrown a block's memory is left to a last launch of few blocks, whose memory has room for all that a world can
// hold.
#pragma once

#include "pictura/common/raster_item.h"

namespace pictura::cuda {

constexpr int kMaxCameras = 64;

/// Where one camera's images go; strides as in CameraImages.
struct CameraSlot {
  PinholeCamera camera;  // in the ego frame
  void* color = nullptr;
  int64_t view_stride = 0;
  float* depth_m = nullptr;
  uint8_t* class_id = nullptr;
  uint16_t* instance_id = nullptr;
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
  RasterGeometry raster;
  PieceGrid strips, walls;
};

/// What was wrong with a view: written by the kernels, thrown by the next call.
struct Fault {
  int32_t view = -1;  // -1: none
  int32_t kind = 0;
};
enum FaultKind : int32_t { kBadWorld = 1, kBadGeometry, kBadPose, kTooManyAgents, kBadQuery, kNoRoom };

/// What an image shows: its faces in a pool, and what tells which of them is in front.
struct GatheredImage {
  int32_t face_begin = 0, face_count = 0;  // -1: not gathered
  int32_t width_px = 0;
  Vec3 eye_m;
  const DeviceGeometry* geometry = nullptr;
  const AgentBox* agents = nullptr;  // the first of its world
};

/// From what the faces of an image are made, and where they go. Of lights: the states of its world.
struct alignas(16) FaceMaking {
  ImageSetting setting;
  const Strip* strips = nullptr;
  const WallFace* walls = nullptr;
  const LightHead* heads = nullptr;
  const AgentBox* agents = nullptr;
  const LightState* lights = nullptr;
  ScreenFace* faces = nullptr;  // [max_faces] of this image
  PolygonEdge* edges = nullptr;  // [max_edges]
  int32_t* num_faces = nullptr;  // that there are
  int32_t* num_edges = nullptr;  // that are taken; may outgrow max_edges
  int32_t max_faces = 0, max_edges = 0;
};

/// Things of an image whose faces are to be made: entries of renderer_cuda_cull.cuh.
struct FaceBatch {
  static constexpr int kEntries = 32;
  uint32_t entries[kEntries];
  int32_t image;
};

/// Faces of many images, and what is known of those images before.
struct FacePool {
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  GatheredImage* images = nullptr;  // [images]
  FaceMaking* makings = nullptr;    // [images]
  FaceBatch* batches = nullptr;
  int32_t max_faces = 0, max_edges = 0, max_batches = 0;
};

/// Memory of the blocks of the last launch, and how much each of them has.
struct Scratch {
  ScreenFace* faces = nullptr;     // [blocks][max_faces]
  PolygonEdge* edges = nullptr;    // [blocks][max_edges]
  unsigned char* bytes = nullptr;  // [blocks][large_bytes()]
  int32_t blocks = 0, max_faces = 0, max_edges = 0;
};

/// Images are gathered and drawn in rounds: those for which the pool had no room left are postponed to the next one.
constexpr int kRounds = 3;

/// What the blocks of a batch's launches count together; 0 before.
struct DrawCounters {
  struct Round {
    int32_t next_culled = 0, next_batch = 0, next_drawn = 0;
    int32_t batches = 0, faces = 0, edges = 0;  // of the pool that are taken
    int32_t postponed = 0;                      // images
  } rounds[kRounds];
  int32_t overflow = 0;  // images left to the last launch
};

struct DrawTask {
  SceneBatch scene;  // in device memory, like all that follows
  const View* views = nullptr;
  int32_t first_view = 0;  // views [first_view, first_view + num_views) are drawn
  int32_t num_views = 0, num_cameras = 0;
  const DeviceGeometry* geometries = nullptr;
  int32_t num_geometries = 0;
  int32_t max_world_agents = 0;
  float line_floor_px = 0;
  bool debug_palette = false;
  PixelFormat format = PixelFormat::u8;
  bool wants_planes = false;
  Fault* fault = nullptr;
  FacePool pool;
  DrawCounters* counters = nullptr;
  int32_t round_index = 0;
  int32_t* postponed_images[2] = {};   // [images] of each round, in turn
  int32_t* overflow_images = nullptr;  // [images]
  CameraSlot cameras[kMaxCameras];
};

struct VisibilityTask {
  DrawTask draw;
  const int32_t* queries = nullptr;  // [2 * num_queries] view, agent
  int32_t num_queries = 0;
  float* visibility = nullptr;
};

}  // namespace pictura::cuda
