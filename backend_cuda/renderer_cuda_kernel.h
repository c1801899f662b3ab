// What the host tells the drawing kernels. A block draws one image at a time: it gathers what the camera may see into
// its own scratch memory, orders it, and composites the pixels. Images that outgrow a block's scratch go to a second
// launch of fewer blocks with room for everything.
#pragma once

#include <cuda_runtime_api.h>

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

/// What was wrong with a view: written by the kernels, thrown by the next call.
struct Fault {
  int32_t view = -1;  // -1: none
  int32_t kind = 0;
};
enum FaultKind : int32_t { kBadWorld = 1, kBadGeometry, kBadPose, kTooManyAgents, kBadQuery, kNoRoom };

/// A block's memory, and how many things fit into it.
struct Scratch {
  RasterItem* items = nullptr;  // [blocks][max_items], and so on
  ScreenFace* faces = nullptr;
  PolygonEdge* edges = nullptr;
  int32_t* order = nullptr;       // [blocks][max_items] front to back
  int32_t* foreground = nullptr;  // [blocks][max_items] nearest first
  int64_t* waiting = nullptr;     // [blocks][max_items] of the foreground: weight of what is still in front
  int32_t blocks = 0, max_items = 0, max_faces = 0, max_edges = 0;
};

struct DrawTask {
  SceneBatch scene;  // in device memory, like all that follows
  const View* views = nullptr;
  int32_t num_views = 0, num_cameras = 0;
  const RasterGeometry* geometries = nullptr;
  int32_t num_geometries = 0;
  int32_t max_world_agents = 0;
  float line_floor_px = 0;
  bool debug_palette = false;
  bool as_float = false;  // else bytes
  Fault* fault = nullptr;
  int32_t* overflow_count = nullptr;   // images left to the second launch; 0 before the first
  int32_t* overflow_images = nullptr;  // [images]
  CameraSlot cameras[kMaxCameras];
};

/// Draws all images; both launches.
void launch_draw(const DrawTask& task, const Scratch& small, const Scratch& large, cudaStream_t stream);

struct VisibilityTask {
  DrawTask draw;
  const int32_t* queries = nullptr;  // [2 * num_queries] view, agent
  int32_t num_queries = 0;
  float* visibility = nullptr;
};
void launch_visibility(const VisibilityTask& task, const Scratch& large, cudaStream_t stream);

}  // namespace pictura::cuda
