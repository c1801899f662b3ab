// Interface of the renderers `cpu`, `cuda`, `gl` and `null`. backends/make_renderer.h creates them by name.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/camera.h"
#include "pictura/common/camera_randomization.h"
#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Point samples per pixel, for the renderer `gl`. Other renderers compute exact coverage.
struct PixelSamples {
  int grid = 1;         // supersampling: grid x grid samples
  int multisample = 1;  // MSAA; rounded up to a number that the driver supports
  bool operator==(const PixelSamples&) const = default;
};

/// Maximum of RendererConfig::line_floor_px: the guard band (common/raster/camera.h), so that culling keeps all widened
/// strips.
constexpr float kMaxLineFloor_px = 8;

struct RendererConfig {
  Rig rig = paper_rig();
  Device device;                // device of scenes, views and images
  int num_threads = 0;          // host threads; 0: all
  float line_floor_px = 0.35f;  // minimum width of road paint on screen; 0: no minimum
  bool debug_palette = false;   // tint halted and parked agents
  PixelSamples samples;
  CameraRandomization randomization;  // `gl` randomizes only poses and focal lengths
  /// Only for `cuda`: bound on device memory besides images, scenes and maps. Larger calls draw their images in parts.
  std::size_t max_scratch_bytes = std::size_t{1} << 30;
};

/// Base class of renderers. Only one thread at a time may use an object.
///
/// On a CUDA device, calls enqueue their work on the stream, and keep the caller's current device. All calls share the
/// renderer's memory: issue them on one stream, or make each call wait for the previous call. A call neither allocates
/// nor waits if an earlier call or reserve() covers its sizes. A CUDA graph may contain such calls until generation()
/// changes. Kernels latch faults that they find in a scene. poll(), check() or the next call throws an Error for a
/// latched fault.
class Renderer {
 public:
  virtual ~Renderer() = default;
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  virtual std::string_view name() const = 0;
  /// Device of scenes, views, queries and images.
  virtual Device device() const = 0;
  virtual const RendererConfig& config() const = 0;
  /// Whether the renderer draws all pixel formats, as planar images and as patches. Other renderers draw only planar
  /// images in u8 or f32.
  virtual bool draws_all_formats() const { return true; }

  /// Copies a map's geometry, replacing the handle's earlier geometry. The caller chooses the handle, so that one scene
  /// serves several renderers. Waits for the stream. Throws Error if the handle or the geometry is invalid.
  virtual void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream = {}) = 0;
  /// Frees the geometry of a handle, if any, after all earlier calls have ended.
  virtual void release(GeometryHandle handle, Stream stream = {}) = 0;

  /// Allocates memory for calls with up to max_views views and max_boxes boxes in all worlds, given the uploaded maps.
  /// May wait for the device. Has no effect on the host.
  virtual void reserve(int /*max_views*/, int /*max_boxes*/) {}
  /// Counter of events that invalidate captured graphs. Always 0 on the host.
  virtual uint64_t generation() const { return 0; }

  /// Draws the first views.num_views views with every camera of the rig, and writes each pixel of their images. Throws
  /// Error if an array is on the wrong device, if a handle, index or number is out of range, or if the images do not
  /// fit.
  ///
  /// On a CUDA device, a view's invalid world, handle, pose or range of hidden agents is a latched fault. The view's
  /// images are then black. An invalid number of views is a latched fault and is clamped. On a CUDA device, boxes, egos
  /// and the order of world_begin and light_begin are not checked.
  virtual void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out,
                      Stream stream = {}) = 0;

  /// Computes the visible share of each query's agent, in [0, 1]: its coverage in the view's images divided by its
  /// coverage when drawn alone. The share is NaN if no image contains the agent, or if the view is at or beyond
  /// views.num_views. `visibility_out` has the length of `queries`.
  virtual void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                          Span<float> visibility_out, Stream stream = {}) = 0;

  /// Throws Error if a latched fault has reached the host. Does not wait.
  virtual void poll() {}
  /// Waits for the stream, then calls poll().
  virtual void check(Stream /*stream*/ = {}) {}
};

/// Uploads geometries to the handles 0, 1, ...
inline void upload_geometries(Span<const StaticGeometry> geometries, Renderer* renderer_out) {
  GeometryHandle handle = 0;
  for (const StaticGeometry& geometry : geometries) renderer_out->upload(handle++, geometry);
}

}  // namespace pictura
