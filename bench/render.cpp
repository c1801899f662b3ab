#include "pictura/bench/render.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/bench/repeats.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/bench/render_device.h"
#endif

namespace pictura {

namespace {

class HostTarget final : public RenderTarget {
 public:
  HostTarget(const DrivenWorlds& worlds, const RenderCase& render_case)
      : scene_(worlds.simulator->scene()),
        views_(worlds.views.data(), static_cast<std::size_t>(render_case.num_views)),
        images_(images_of(render_case, render_case.num_views)) {}
  void fill_unwritten() override { pictura::fill_unwritten(images_.batch()); }
  double draw(Renderer* renderer, int calls) override {
    const auto begin = std::chrono::steady_clock::now();
    for (int call = 0; call < calls; ++call) renderer->render(scene_, views_, images_.batch());
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count() / calls;
  }
  const HostImages& images(int) override { return images_; }

 private:
  const SceneBatch& scene_;
  Span<const View> views_;
  HostImages images_;
};

// Images of the first views by the oracle (the CPU renderer), for comparisons.
class OracleCheck {
 public:
  OracleCheck(const DrivenWorlds& worlds, const RenderCase& render_case)
      : render_case_(render_case),
        num_views_(std::min(render_case.checked_views, render_case.num_views)),
        expected_(images_of(render_case, num_views_)) {
    const RendererConfig config{.rig = render_case.config.rig, .line_floor_px = render_case.config.line_floor_px};
    const auto oracle = make_renderer("cpu", config);
    upload_maps(*worlds.simulator, oracle.get());
    oracle->render(worlds.simulator->scene(),
                   Span<const View>(worlds.views.data(), static_cast<std::size_t>(num_views_)), expected_.batch());
  }

  /// Adds the target's errors to error_inout. Throws Error if `cuda` is out of tolerance.
  void compare(RenderTarget* target, ImageError* error_inout) const {
    const HostImages& actual = target->images(num_views_);
    ImageError error;
    for (int k = 0; k < static_cast<int>(render_case_.config.rig.cameras.size()); ++k) {
      for (int view = 0; view < num_views_; ++view) {
        error.add(compare_image(actual.camera(k), expected_.camera(k), render_case_.format, view, render_case_.order,
                                render_case_.patch_px));
      }
    }
    error_inout->add(error);
    if (render_case_.backend != "cuda") return;
    PICTURA_CHECK(error.is_within_tolerance(),
                  "bench render: cuda: expected the oracle's images, got {} of {} values off by more than 1/255, {} at "
                  "worst, and planes of another surface at {} of {} pixels",
                  error.beyond, error.values, error.worst, error.differing_plane_pixels, error.plane_pixels);
  }

 private:
  const RenderCase& render_case_;
  int num_views_;
  HostImages expected_;
};

std::unique_ptr<RenderTarget> make_target(const DrivenWorlds& worlds, const RenderCase& render_case) {
  if (render_case.config.device.is_host()) return make_host_target(worlds, render_case);
#ifdef PICTURA_HAS_CUDA
  return make_device_target(worlds, render_case);
#else
  fail("bench render: this build has no CUDA");
#endif
}

std::size_t image_bytes_of(const RenderCase& render_case) {
  return image_layout(render_case.config.rig, render_case.num_views, render_case.format, render_case.order,
                      render_case.patch_px)
      .bytes();
}

}  // namespace

HostImages images_of(const RenderCase& render_case, int num_views) {
  return HostImages(render_case.config.rig, num_views, render_case.format, render_case.planes, render_case.order,
                    render_case.patch_px);
}

std::unique_ptr<RenderTarget> make_host_target(const DrivenWorlds& worlds, const RenderCase& render_case) {
  return std::make_unique<HostTarget>(worlds, render_case);
}

RenderMeasurement measure_render(const DrivenWorlds& worlds, const RenderCase& render_case) {
  RenderMeasurement result;
  const auto target = make_target(worlds, render_case);
  target->fill_unwritten();  // before memory is measured, because the target's memory does not belong to the renderer
  result.image_bytes = static_cast<double>(image_bytes_of(render_case));
  PICTURA_CHECK(!render_case.measures_memory || !cuda_device_name().empty(),
                "bench render: expected a CUDA device to measure memory on, found none");
#ifdef PICTURA_HAS_CUDA
  std::unique_ptr<DeviceMemoryMeter> meter;
  if (render_case.measures_memory) meter = std::make_unique<DeviceMemoryMeter>();
#endif
  const auto renderer = make_renderer(render_case.backend, render_case.config, &result.choice);
  upload_maps(*worlds.simulator, renderer.get());
#ifdef PICTURA_HAS_CUDA
  if (meter) result.up_front_bytes = meter->used_bytes();
#endif
  target->draw(renderer.get(), 1);  // warms up
  renderer->check();
  std::optional<OracleCheck> check;
  if (render_case.checked_views > 0 && render_case.backend != "cpu" && render_case.backend != "null") {
    check.emplace(worlds, render_case);
    check->compare(target.get(), &result.error);
  }
  if (render_case.repeats > 0) {
    target->fill_unwritten();
    const double one_ms = target->draw(renderer.get(), 1);
    const int calls = calls_in_repeat(render_case.repeat_s, one_ms);
    for (int repeat = 0; repeat < render_case.repeats; ++repeat) {
      result.call_ms.push_back(target->draw(renderer.get(), calls));
      throw_if_interrupted();
    }
    renderer->check();
    if (check) check->compare(target.get(), &result.error);
  }
#ifdef PICTURA_HAS_CUDA
  if (meter) result.max_bytes = meter->max_bytes();
#endif
  return result;
}

#ifndef PICTURA_HAS_CUDA
std::string cuda_device_name() { return ""; }
std::string cuda_driver_name() { return ""; }
#endif

}  // namespace pictura
