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

/// Numbers of point samples per pixel; a pixel's colour is the mean of its samples. Only the renderer `gl` samples; the
/// other renderers compute exact coverage.
struct PixelSamples {
  int grid = 1;         // supersampling: grid x grid
  int multisample = 1;  // MSAA with the driver's pattern; rounded up if the driver lacks this number
  bool operator==(const PixelSamples&) const = default;
};

/// Maximum of RendererConfig::line_floor_px. It equals the guard band around an image (common/raster/camera.h), so that
/// culling keeps every strip that widening brings into the image.
constexpr float kMaxLineFloor_px = 8;

struct RendererConfig {
  Rig rig = paper_rig();
  Device device;                // device of the caller's scenes, views and images
  int num_threads = 0;          // host threads; 0: all
  float line_floor_px = 0.35f;  // minimum width on screen of a strip of road paint; 0: no minimum
  bool debug_palette = false;   // tint halted and parked agents
  PixelSamples samples;
  CameraRandomization randomization;  // `gl` randomizes only poses and focal lengths
  /// Only for `cuda`: upper bound on device memory besides images, scenes and maps. A call that needs more memory draws
  /// its images in several parts.
  std::size_t max_scratch_bytes = std::size_t{512} << 20;
};

/// Base class of renderers. Only one thread at a time may use an object; distinct objects are independent.
///
/// A renderer on a CUDA device makes that device current in each call and restores the caller's device. A call returns
/// when its work is enqueued on the stream. All calls use the same memory of the renderer: issue them on one stream, or
/// make each call wait for the previous call. A call whose sizes do not exceed those of an earlier call, or of
/// reserve(), neither allocates nor waits. Such a call can be captured into a CUDA graph, which stays valid until
/// generation() changes. Kernels latch the faults that they find in a scene: poll(), check() or the next call throws an
/// Error for a latched fault.
class Renderer {
 public:
  virtual ~Renderer() = default;
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  virtual std::string_view name() const = 0;
  /// Device of the scenes, views, queries and images.
  virtual Device device() const = 0;
  virtual const RendererConfig& config() const = 0;
  /// Whether the renderer draws all pixel formats, both as planar images and as patches. Other renderers draw only
  /// planar images in u8 or f32.
  virtual bool draws_all_formats() const { return true; }

  /// Copies a map's geometry into the renderer, replacing any earlier geometry of this handle. SceneBatch::geometry
  /// refers to the geometry by the handle. The caller chooses the handle in [0, kNumGeometryHandles), so that one scene
  /// serves several renderers. Waits for the stream. Throws Error if the handle or the geometry is invalid.
  virtual void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream = {}) = 0;
  /// Frees the geometry of a handle after all earlier calls have ended. Does nothing for a handle without geometry. The
  /// renderer may keep the memory for later uploads.
  virtual void release(GeometryHandle handle, Stream stream = {}) = 0;

  /// Allocates the memory for calls with up to max_views views and, over all worlds, up to max_boxes boxes, given the
  /// maps uploaded so far. May wait for the device. Renderers on the host allocate during drawing instead.
  virtual void reserve(int /*max_views*/, int /*max_boxes*/) {}
  /// Counter of events that invalidate captured graphs: the renderer's memory moved, or a map larger than all earlier
  /// maps was uploaded. Always 0 on the host.
  virtual uint64_t generation() const { return 0; }

  /// Draws every camera of the rig for every view and writes each pixel of their images. Views at and beyond
  /// views.num_views are neither read nor drawn, and their images are not written. Throws Error if an array lies on the
  /// wrong device, if a handle, an index or the number of views is out of range, or if the images do not fit the rig
  /// and all views. On a CUDA device, a view with an invalid world, handle, pose or range of hidden agents is a latched
  /// fault, and its images are black. A number of views that is out of range is also a latched fault, and is clamped.
  /// Boxes, egos and the order of index ranges are checked only on the host; on a CUDA device, the caller must ensure
  /// that they are valid.
  virtual void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out,
                      Stream stream = {}) = 0;

  /// Computes the visible share of each query's agent, in [0, 1]: its coverage in the view's images divided by its
  /// coverage when it is drawn alone. Both coverages are summed over the cameras. The share is NaN if the agent is in
  /// no camera's image, or if the query's view is at or beyond views.num_views. `visibility_out` has the length of
  /// `queries`.
  virtual void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                          Span<float> visibility_out, Stream stream = {}) = 0;

  /// Throws Error if a latched fault has reached the host. Does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then calls poll().
  virtual void check(Stream /*stream*/ = {}) {}
};

/// Uploads geometries to the handles 0, 1, ...
inline void upload_geometries(Span<const StaticGeometry> geometries, Renderer* renderer_out) {
  GeometryHandle handle = 0;
  for (const StaticGeometry& geometry : geometries) renderer_out->upload(handle++, geometry);
}

}  // namespace pictura
