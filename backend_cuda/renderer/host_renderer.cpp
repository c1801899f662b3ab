// The CUDA renderer for callers whose scenes and images lie in host memory: copies them to and from the device and
// waits. The host makes the CPU renderer's checks, so that the call that causes an error throws it.
#include <memory>

#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/cuda/device_scene.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/host_geometries.h"

namespace pictura {

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out);
std::unique_ptr<Renderer> make_cuda_renderer_for_host(const RendererConfig& config, std::string* origin_out);

namespace {

class HostRendererCuda final : public Renderer {
 public:
  HostRendererCuda(const RendererConfig& config, std::string* origin_out)
      : config_(config), renderer_(make_cuda_renderer(on_current_device(config), origin_out)) {}
  std::string_view name() const override { return renderer_->name(); }
  Device device() const override { return {}; }
  const RendererConfig& config() const override { return config_; }

  void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream) override {
    renderer_->upload(handle, geometry, stream);
    geometries_.upload(handle, geometry);
  }
  void release(GeometryHandle handle, Stream stream) override {
    renderer_->release(handle, stream);
    geometries_.release(handle);
  }
  void reserve(int max_views, int max_boxes) override { renderer_->reserve(max_views, max_boxes); }

  void render(const SceneBatch& scene, const ViewBatch& batch, const ImageBatch& images_out, Stream stream) override {
    const DeviceGuard guard(renderer_->device());
    check_images(*this, batch.size(), images_out);
    const Span<const View> views = counted_views(name(), batch);
    check_input(scene, views);
    ImageBatch drawn = images_out;
    drawn.num_views = static_cast<int>(views.size());
    const auto queue = static_cast<cudaStream_t>(stream.handle);
    renderer_->render(scene_.assign(scene, queue), views_.assign(views, queue), images_.like(drawn), stream);
    images_.copy_to_host(drawn, queue);
    check(stream);
  }

  void poll() override { renderer_->poll(); }
  void check(Stream stream) override { renderer_->check(stream); }

  void visibility(const SceneBatch& scene, const ViewBatch& batch, Span<const VisibilityQuery> queries,
                  Span<float> visibility_out, Stream stream) override {
    const DeviceGuard guard(renderer_->device());
    const Span<const View> views = counted_views(name(), batch);
    check_input(scene, views);
    check_queries(name(), scene, views, batch.size(), queries, visibility_out.size());
    const auto queue = static_cast<cudaStream_t>(stream.handle);
    const Span<float> result = visibility_.resize(queries.size());
    // Passes all views, so that queries about views beyond the count are answered.
    const auto count = static_cast<int32_t>(views.size());
    const ViewBatch counted{views_.assign(batch.views, queue), count_.assign({&count, 1}, queue).data()};
    renderer_->visibility(scene_.assign(scene, queue), counted, queries_.assign(queries, queue), result, stream);
    if (!queries.empty()) {
      PICTURA_CUDA(cudaMemcpyAsync(visibility_out.data(), result.data(), result.size() * sizeof(float),
                                   cudaMemcpyDeviceToHost, queue));
    }
    check(stream);
  }

 private:
  static RendererConfig on_current_device(RendererConfig config) {
    config.device = current_device();
    return config;
  }

  void check_input(const SceneBatch& scene, Span<const View> views) const {
    check_scene(name(), scene, geometries_);
    check_views(name(), scene, views);
  }

  RendererConfig config_;
  std::unique_ptr<Renderer> renderer_;
  HostGeometries geometries_;  // for checks
  DeviceScene scene_;
  DeviceImages images_;
  DeviceUpload<View> views_;
  DeviceUpload<int32_t> count_;
  DeviceUpload<VisibilityQuery> queries_;
  DeviceUpload<float> visibility_;
};

}  // namespace

std::unique_ptr<Renderer> make_cuda_renderer_for_host(const RendererConfig& config, std::string* origin_out) {
  return std::make_unique<HostRendererCuda>(config, origin_out);
}

}  // namespace pictura
