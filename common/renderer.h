// The interface of everything that draws: `cpu`, `cuda`, `gl` and `null`. Made by name in backends/make_renderer.h.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/camera.h"
#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Point samples that a pixel's colour is the mean of. `gl` alone takes them; the others compute exact coverage.
struct PixelSamples {
  int grid = 1;         // supersampling: grid x grid
  int multisample = 1;  // MSAA: the driver's pattern, or more samples where it lacks this number
  bool operator==(const PixelSamples&) const = default;
};

struct RendererConfig {
  Rig rig = paper_rig();
  Device device;                // where the caller keeps scenes, views and images
  int num_threads = 0;          // host threads; 0: all
  float line_floor_px = 0.35f;  // least width of a strip on screen, measured across it; 0 turns the floor off
  bool debug_palette = false;   // tint halted and parked agents
  PixelSamples samples;
  /// cuda: the most device memory that it takes beyond images, scenes and maps; what does not fit is drawn in parts.
  std::size_t max_scratch_bytes = std::size_t{512} << 20;
};

/// An object serves one thread at a time; distinct objects are independent. A renderer on a device works on the device
/// that was current when it was made, and shares its memory among its calls: put them on one stream, or let each wait
/// for the one before. A captured CUDA graph holds for as long as no call is for more than was seen before (views,
/// agents, maps): then capture anew.
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

  /// Takes a copy of a map's geometry; the handle names it in SceneBatch::geometry and is valid for the object's life.
  virtual GeometryHandle upload(const StaticGeometry& geometry) = 0;

  /// Draws every camera of the rig for every view: each pixel of `images_out` is written. Throws Error when a span lies
  /// in the wrong memory space, a handle or index is out of range, or the images do not fit the rig and views. What
  /// only a device can see is wrong with a scene there, the next call throws, or check(); such views are black.
  virtual void render(const SceneBatch& scene, Span<const View> views, const ImageBatch& images_out,
                      Stream stream = {}) = 0;

  /// Waits until everything asked for is done; throws Error where a device found a fault since the last call that
  /// threw.
  virtual void check() {}

  /// For each query: coverage of the agent in the view's images over its coverage when drawn alone, summed over the
  /// cameras, in [0, 1]; NaN where it is in no camera's frame. `visibility_out` has the queries' length.
  virtual void visibility(const SceneBatch& scene, Span<const View> views, Span<const VisibilityQuery> queries,
                          Span<float> visibility_out, Stream stream = {}) = 0;
};

/// Uploads geometries to a new renderer, so that handles equal their indices.
inline void upload_geometries(Span<const StaticGeometry> geometries, Renderer* renderer_out) {
  GeometryHandle expected = 0;
  for (const StaticGeometry& geometry : geometries) {
    const GeometryHandle handle = renderer_out->upload(geometry);
    PICTURA_CHECK(handle == expected++, "renderer {}: expected handle {}, got {}", renderer_out->name(), expected - 1,
                  handle);
  }
}

}  // namespace pictura
