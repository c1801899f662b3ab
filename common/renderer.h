// The interface of everything that draws: `cpu`, `cuda`, `gl` and `null`. Made by name in backends/make_renderer.h.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/camera.h"
#include "pictura/common/camera_randomization.h"
#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Point samples that a pixel's colour is the mean of. `gl` alone takes them; the others compute exact coverage.
struct PixelSamples {
  int grid = 1;         // supersampling: grid x grid
  int multisample = 1;  // MSAA: the driver's pattern, or more samples where it lacks this number
  bool operator==(const PixelSamples&) const = default;
};

/// Largest line floor: that of the guard band (common/raster/camera.h), within which strips are widened.
constexpr float kMaxLineFloor_px = 8;

struct RendererConfig {
  Rig rig = paper_rig();
  Device device;                // where the caller keeps scenes, views and images
  int num_threads = 0;          // host threads; 0: all
  float line_floor_px = 0.35f;  // minimum width of a strip on screen, measured across it; 0 turns the floor off
  bool debug_palette = false;   // tint halted and parked agents
  PixelSamples samples;
  CameraRandomization randomization;  // gl takes poses and focal lengths alone
  /// cuda: upper bound on the device memory that it takes beyond images, scenes and maps; calls that need more are
  /// drawn in several parts.
  std::size_t max_scratch_bytes = std::size_t{512} << 20;
};

/// An object serves one thread at a time; distinct objects are independent.
///
/// A renderer on a CUDA device makes that device current in each call and restores the caller's. Its calls return when
/// their work is on the stream, and share the renderer's memory: put them on one stream, or make each wait for the one
/// before. A call whose sizes are within those of an earlier call, or of reserve(), neither allocates nor waits, and
/// can be captured into a CUDA graph; the graph is valid for as long as generation() does not change. What kernels find
/// wrong with a scene is latched: poll(), check() or the next call throws it.
class Renderer {
 public:
  virtual ~Renderer() = default;
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  virtual std::string_view name() const = 0;
  /// Where scenes, views and queries are read from and images written to.
  virtual Device device() const = 0;
  virtual const RendererConfig& config() const = 0;
  /// Whether it draws every format, and patches as well as planar images; otherwise it draws u8 and f32, planar.
  virtual bool draws_all_formats() const { return true; }

  /// Copies a map's geometry. The caller chooses the handle, in [0, kNumGeometryHandles), that names it in
  /// SceneBatch::geometry, so that one scene serves several renderers; what the handle held before is replaced for the
  /// calls that follow. Waits for the stream. Throws Error where the handle or the geometry is invalid.
  virtual void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream = {}) = 0;
  /// Frees a handle after the calls before; nothing happens where it holds nothing. Its memory may be kept for maps
  /// that are uploaded later.
  virtual void release(GeometryHandle handle, Stream stream = {}) = 0;

  /// Allocates what calls of up to so many views, of scenes of up to so many boxes in all worlds, need with the maps
  /// that are uploaded now. May wait for the device. Renderers on the host allocate as they draw.
  virtual void reserve(int /*max_views*/, int /*max_boxes*/) {}
  /// How often captured graphs have become stale: memory that calls use has moved, or a map was uploaded that is larger
  /// than those of earlier calls. 0 on the host.
  virtual uint64_t generation() const { return 0; }

  /// Draws every camera of the rig for every view and writes each pixel of their images. Views at and beyond
  /// views.num_views are not read or drawn, and their images are not written. Throws Error where an array lies on the
  /// wrong device, a handle, an index or the number of views is out of range, or the images do not fit the rig and all
  /// views. On a CUDA device a view whose world, handle, pose or range of hidden agents is wrong is a latched fault,
  /// and its images are black; so is a wrong number of views, which is clamped. Boxes, egos and the order of ranges are
  /// checked on the host alone: on a device they must be right.
  virtual void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out,
                      Stream stream = {}) = 0;

  /// For each query: coverage of the agent in the view's images over its coverage when drawn alone, summed over the
  /// cameras, in [0, 1]; NaN where it is in no camera's frame, and for a view at or beyond views.num_views.
  /// `visibility_out` has the queries' length.
  virtual void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                          Span<float> visibility_out, Stream stream = {}) = 0;

  /// Throws Error where a latched fault has reached the host; does not wait.
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
