// Interface of all renderers: `cpu`, `cuda`, `gl` and `null`. backends/make_renderer.h creates them by name.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/camera.h"
#include "pictura/common/camera_randomization.h"
#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Point samples whose mean is a pixel's colour. Only `gl` uses them; the other renderers compute exact coverage.
struct PixelSamples {
  int grid = 1;         // supersampling: grid x grid
  int multisample = 1;  // MSAA with the driver's pattern; rounded up if the driver lacks this number
  bool operator==(const PixelSamples&) const = default;
};

/// Maximum line floor: the guard band (common/raster/camera.h), within which strips are widened.
constexpr float kMaxLineFloor_px = 8;

struct RendererConfig {
  Rig rig = paper_rig();
  Device device;                // device of the caller's scenes, views and images
  int num_threads = 0;          // host threads; 0: all
  float line_floor_px = 0.35f;  // minimum width of a strip on screen, measured across it; 0 turns the floor off
  bool debug_palette = false;   // tint halted and parked agents
  PixelSamples samples;
  CameraRandomization randomization;  // gl applies only poses and focal lengths
  /// cuda: upper bound on device memory besides images, scenes and maps. Calls that need more are drawn in several
  /// parts.
  std::size_t max_scratch_bytes = std::size_t{512} << 20;
};

/// Base class of renderers. An object serves one thread at a time; distinct objects are independent.
///
/// A renderer on a CUDA device makes that device current in each call and restores the caller's device. Its calls
/// return when their work is on the stream. They share the renderer's memory: issue them on one stream, or make each
/// call wait for the previous one. A call whose sizes are within those of an earlier call, or of reserve(), neither
/// allocates nor waits, and can be captured into a CUDA graph. The graph stays valid until generation() changes. Faults
/// that kernels find in a scene are latched: poll(), check() or the next call throws them.
class Renderer {
 public:
  virtual ~Renderer() = default;
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  virtual std::string_view name() const = 0;
  /// Device that scenes, views and queries are read from and images are written to.
  virtual Device device() const = 0;
  virtual const RendererConfig& config() const = 0;
  /// Whether the renderer draws every format, and patches as well as planar images; otherwise it draws u8 and f32,
  /// planar.
  virtual bool draws_all_formats() const { return true; }

  /// Copies a map's geometry. The caller chooses the handle, in [0, kNumGeometryHandles), that refers to the geometry
  /// in SceneBatch::geometry, so that one scene serves several renderers. Later calls use this geometry instead of the
  /// handle's previous one. Waits for the stream. Throws Error if the handle or the geometry is invalid.
  virtual void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream = {}) = 0;
  /// Frees a handle after all earlier calls; does nothing for a handle without geometry. The memory may be kept for
  /// later uploads.
  virtual void release(GeometryHandle handle, Stream stream = {}) = 0;

  /// Allocates the memory for calls of up to max_views views, of scenes of up to max_boxes boxes in all worlds, with
  /// the maps that are uploaded now. May wait for the device. Renderers on the host allocate as they draw.
  virtual void reserve(int /*max_views*/, int /*max_boxes*/) {}
  /// Counter of events that make captured graphs stale: memory that calls use has moved, or a map larger than all
  /// earlier maps was uploaded. 0 on the host.
  virtual uint64_t generation() const { return 0; }

  /// Draws every camera of the rig for every view and writes each pixel of their images. Views at and beyond
  /// views.num_views are neither read nor drawn, and their images are not written. Throws Error if an array lies on the
  /// wrong device, if a handle, an index or the number of views is out of range, or if the images do not fit the rig
  /// and all views. On a CUDA device, a view with an invalid world, handle, pose or range of hidden agents is a latched
  /// fault, and its images are black. A wrong number of views is a latched fault too, and is clamped. Boxes, egos and
  /// the order of ranges are checked only on the host; on a device the caller must ensure that they are valid.
  virtual void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out,
                      Stream stream = {}) = 0;

  /// Computes for each query the coverage of the agent in the view's images over its coverage when drawn alone, summed
  /// over the cameras, in [0, 1]. The result is NaN if the agent is in no camera's frame, and for a view at or beyond
  /// views.num_views. `visibility_out` has the length of `queries`.
  virtual void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                          Span<float> visibility_out, Stream stream = {}) = 0;

  /// Throws Error if a latched fault has reached the host. Does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then polls.
  virtual void check(Stream /*stream*/ = {}) {}
};

/// Uploads geometries to the handles 0, 1, ...
inline void upload_geometries(Span<const StaticGeometry> geometries, Renderer* renderer_out) {
  GeometryHandle handle = 0;
  for (const StaticGeometry& geometry : geometries) renderer_out->upload(handle++, geometry);
}

}  // namespace pictura
