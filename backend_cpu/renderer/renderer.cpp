// The CPU renderer, which is the reference (oracle) for all other renderers. It checks its input, places the cameras,
// and distributes images over threads.
#include <cstddef>
#include <memory>
#include <vector>

#include <omp.h>

#include "pictura/backend_cpu/renderer/image_drawer.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/host_geometries.h"
#include "pictura/common/support/parallel_for.h"

namespace pictura {

std::unique_ptr<Renderer> make_cpu_renderer(const RendererConfig& config);

namespace {

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(const RendererConfig& config)
      : config_(check_config("cpu", config)),
        cameras_(pinhole_cameras(config.rig)),
        drawers_(static_cast<std::size_t>(resolve_num_threads(config.num_threads))) {}
  std::string_view name() const override { return "cpu"; }
  Device device() const override { return {}; }
  const RendererConfig& config() const override { return config_; }

  void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream) override {
    check_handle(name(), handle);
    check_geometry(name(), geometry);
    geometries_.upload(handle, geometry);
    const auto index = static_cast<std::size_t>(handle);
    if (index >= culled_.size()) culled_.resize(index + 1);
    culled_[index] = std::make_unique<const CulledGeometry>(*geometries_.find(handle));
  }
  void release(GeometryHandle handle, Stream) override {
    check_handle(name(), handle);
    geometries_.release(handle);
    if (static_cast<std::size_t>(handle) < culled_.size()) culled_[handle].reset();
  }

  void render(const SceneBatch& scene, const ViewBatch& batch, const ImageBatch& images_out, Stream) override {
    check_images(*this, batch.size(), images_out);
    const Span<const View> views = counted_views(name(), batch);
    check_scene(name(), scene, geometries_);
    check_views(name(), scene, views);
    sort_crowds(scene, views);
    const std::size_t num_cameras = cameras_.size();
    parallel_for(num_threads(), static_cast<int64_t>(views.size() * num_cameras), [&](int64_t image, int thread) {
      const std::size_t view = static_cast<std::size_t>(image) / num_cameras;
      const std::size_t camera = static_cast<std::size_t>(image) % num_cameras;
      ImageDrawer& drawer = drawers_[thread];
      drawer.prepare(request(scene, views[view], camera));
      ImageTarget out = target(images_out, view, camera);
      out.effect = image_effect(config_.randomization, views[view].key, static_cast<int>(camera));
      drawer.draw(out);
    });
  }

  void visibility(const SceneBatch& scene, const ViewBatch& batch, Span<const VisibilityQuery> queries,
                  Span<float> visibility_out, Stream) override {
    const Span<const View> views = counted_views(name(), batch);
    check_scene(name(), scene, geometries_);
    check_views(name(), scene, views);
    check_queries(name(), scene, views, batch.size(), queries, visibility_out.size());
    crowds_.clear();
    parallel_for(num_threads(), static_cast<int64_t>(queries.size()), [&](int64_t i, int thread) {
      const VisibilityQuery& query = queries[i];
      ImageDrawer& drawer = drawers_[thread];
      VisibilitySum seen;
      const bool is_drawn = static_cast<std::size_t>(query.view) < views.size();
      for (std::size_t camera = 0; is_drawn && camera < cameras_.size(); ++camera) {
        ImageRequest image = request(scene, views[query.view], camera);
        image.culls_occluded = false;  // occluded faces count when the agent is drawn alone
        drawer.prepare(image);
        drawer.accumulate_visibility(query.agent, &seen);
      }
      visibility_out[i] = seen.share();
    });
  }

 private:
  int num_threads() const { return static_cast<int>(drawers_.size()); }

  // Sorts the boxes of those worlds in which testing all boxes in every image would take longer than sorting.
  void sort_crowds(const SceneBatch& scene, Span<const View> views) {
    constexpr int32_t kMinBoxes = 256, kMinViews = 16;
    std::vector<int32_t> num_views(scene.geometry.size());
    for (const View& view : views) ++num_views[view.world];
    crowds_.clear();
    crowds_.resize(scene.geometry.size());
    parallel_for(num_threads(), static_cast<int64_t>(crowds_.size()), [&](int64_t world) {
      const auto index = static_cast<std::size_t>(world);
      const int32_t begin = scene.world_begin[index], num_boxes = scene.world_begin[index + 1] - begin;
      if (num_boxes < kMinBoxes || num_views[index] < kMinViews) return;
      crowds_[index] = std::make_unique<const Crowd>(
          Span<const AgentBox>(scene.agents.data() + begin, static_cast<std::size_t>(num_boxes)));
    });
  }

  ImageRequest request(const SceneBatch& scene, const View& view, std::size_t camera) const {
    const GeometryHandle handle = scene.geometry[view.world];
    const auto world = static_cast<std::size_t>(view.world);
    const PinholeCamera in_ego =
        randomized_camera(cameras_[camera], config_.randomization, view.key, static_cast<int>(camera));
    return {.geometry = culled_[handle].get(),
            .scene = &scene,
            .view = &view,
            .camera = place_camera(in_ego, view),
            .line_floor_px = config_.line_floor_px,
            .debug_palette = config_.debug_palette,
            .crowd = world < crowds_.size() ? crowds_[world].get() : nullptr};
  }

  static ImageTarget target(const ImageBatch& images, std::size_t view, std::size_t camera) {
    const CameraImages& out = images.cameras[camera];
    const int64_t offset = static_cast<int64_t>(view) * out.view_stride;
    const std::size_t pixels = static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px);
    ImageTarget target{.format = images.format, .order = images.order, .patch_px = images.patch_px};
    target.color = static_cast<std::byte*>(out.data) + offset * static_cast<int64_t>(bytes_per_value(images.format));
    if (out.depth_m) target.depth_m = out.depth_m + view * pixels;
    if (out.class_id) target.class_id = out.class_id + view * pixels;
    if (out.instance_id) target.instance_id = out.instance_id + view * pixels;
    return target;
  }

  RendererConfig config_;
  std::vector<PinholeCamera> cameras_;  // in the ego frame
  HostGeometries geometries_;
  std::vector<std::unique_ptr<const CulledGeometry>> culled_;  // [handle]
  std::vector<std::unique_ptr<const Crowd>> crowds_;           // [worlds of the scene]; null if not sorted
  std::vector<ImageDrawer> drawers_;                           // one per thread
};

}  // namespace

std::unique_ptr<Renderer> make_cpu_renderer(const RendererConfig& config) {
  return std::make_unique<CpuRenderer>(config);
}

}  // namespace pictura
