#include "pictura/backends/make_renderer.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"

namespace pictura {

// The only public symbol of each backend, declared here so that other files cannot call it.
std::unique_ptr<Renderer> make_cpu_renderer(const RendererConfig& config);
#ifdef PICTURA_HAS_CUDA
/// *origin_out receives a text that describes the origin of the kernels.
std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out);
std::unique_ptr<Renderer> make_cuda_renderer_for_host(const RendererConfig& config, std::string* origin_out);
/// Empty if a CUDA device is usable, else the reason why none is.
std::string cuda_unavailable();
#endif

#ifdef PICTURA_HAS_GL
std::unique_ptr<Renderer> make_gl_renderer(const std::string& name, const RendererConfig& config,
                                           std::string* choice_out);
#endif

namespace {

// Renderer that draws black images, so that everything else can run without a renderer.
class NullRenderer final : public Renderer {
 public:
  explicit NullRenderer(const RendererConfig& config) : config_(check_config("null", config)) {}
  std::string_view name() const override { return "null"; }
  Device device() const override { return {}; }
  const RendererConfig& config() const override { return config_; }
  void upload(GeometryHandle handle, const StaticGeometry&, Stream) override { check_handle(name(), handle); }
  void release(GeometryHandle handle, Stream) override { check_handle(name(), handle); }

  void render(const SceneBatch&, const ViewBatch& batch, const ImageBatch& images_out, Stream) override {
    check_images(*this, batch.size(), images_out);
    const Span<const View> views = counted_views(name(), batch);
    const std::size_t value_bytes = bytes_per_value(images_out.format);
    for (const CameraImages& camera : images_out.cameras) {
      const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
      for (std::size_t view = 0; view < views.size(); ++view) {
        auto* first =
            static_cast<uint8_t*>(camera.data) + view * static_cast<std::size_t>(camera.view_stride) * value_bytes;
        const int64_t values = image_values({camera.width_px, camera.height_px}, images_out.order, images_out.patch_px);
        std::memset(first, 0, static_cast<std::size_t>(values) * value_bytes);
        for (std::size_t i = view * pixels; i < (view + 1) * pixels; ++i) {
          if (camera.depth_m) camera.depth_m[i] = std::numeric_limits<float>::infinity();
          if (camera.class_id) camera.class_id[i] = 0;
          if (camera.instance_id) camera.instance_id[i] = 0;
        }
      }
    }
  }

  void visibility(const SceneBatch&, const ViewBatch&, Span<const VisibilityQuery> queries, Span<float> visibility_out,
                  Stream) override {
    check_answers(name(), queries.size(), visibility_out.size());
    for (std::size_t i = 0; i < queries.size(); ++i) visibility_out[i] = std::numeric_limits<float>::quiet_NaN();
  }

 private:
  RendererConfig config_;
};

std::string joined(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

}  // namespace

std::vector<std::string> renderer_names() {
  std::vector<std::string> names{"cpu"};
#ifdef PICTURA_HAS_CUDA
  names.push_back("cuda");
#endif
#ifdef PICTURA_HAS_GL
  names.insert(names.end(), {"gl", "gl:egl", "gl:osmesa"});
#endif
  names.insert(names.end(), {"null", "auto"});
  return names;
}

std::unique_ptr<Renderer> make_renderer(const std::string& name, const RendererConfig& config,
                                        std::string* choice_out) {
  const std::vector<std::string> names = renderer_names();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    fail_usage("renderer: expected one of {}; got '{}'", joined(names), name);
  }
  auto chosen = [&](const std::string& choice) {
    if (choice_out) *choice_out = choice;
  };
#ifdef PICTURA_HAS_GL
  if (name == "gl" || name == "gl:egl" || name == "gl:osmesa") return make_gl_renderer(name, config, choice_out);
#endif
  if (config.samples != PixelSamples{}) {
    fail_usage("renderer {}: samples: only gl supports samples; the other renderers compute exact coverage", name);
  }
  if (name == "cpu") return chosen("cpu: requested"), make_cpu_renderer(config);
  if (name == "null") return chosen("null: requested"), std::make_unique<NullRenderer>(config);
#ifdef PICTURA_HAS_CUDA
  const std::string unavailable = cuda_unavailable();
  auto make_cuda = [&](const char* why) {
    const auto make = !config.device.is_host() ? make_cuda_renderer : make_cuda_renderer_for_host;
    std::string origin;
    auto renderer = make(config, &origin);
    chosen(fmt::format("cuda: {}; {}", why, origin));
    return renderer;
  };
  if (name == "cuda") {
    PICTURA_CHECK(unavailable.empty(), "renderer cuda: {}", unavailable);
    return make_cuda("requested");
  }
  const std::string why_not_cuda = !config.device.is_host() ? unavailable : "scenes and images lie in host memory";
  if (why_not_cuda.empty()) return make_cuda("a device was found");
#else
  const std::string why_not_cuda = "this build has no CUDA";
#endif
  return chosen(fmt::format("cpu: {}", why_not_cuda)), make_cpu_renderer(config);
}

}  // namespace pictura
