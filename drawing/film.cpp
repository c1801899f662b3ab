#include "pictura/drawing/film.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/math.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/video.h"
#include "pictura/drawing/world.h"

namespace pictura {

namespace {

constexpr int kColumns = 4, kCameraWidth_px = 250, kCameraHeight_px = 140, kCameraGap_px = 8;
constexpr int kTopWidth_px = kColumns * kCameraWidth_px + (kColumns - 1) * kCameraGap_px, kTopHeight_px = 512;
constexpr uint8_t kGapGrey = 40;
constexpr double kFramesPerSecond = 20;  // twice real time

RendererConfig view_of(const FilmOptions& options) {
  RendererConfig view{.rig = paper_rig(kCameraWidth_px, kCameraHeight_px)};
  if (options.trained_view) view = film_view(*options.trained_view);
  view.num_threads = options.num_threads;
  return view;
}

// Height of the tallest picture of a camera, including its caption.
int row_height_px(const HostImages& images, const Rig& rig) {
  int height_px = 0;
  for (size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    height_px = std::max(height_px, captioned(images, 0, static_cast<int>(camera), "").height_px);
  }
  return height_px;
}

}  // namespace

RendererConfig film_view(const RendererConfig& trained_view) {
  RendererConfig view = trained_view;
  view.samples = {};  // films have exact coverage
  float line_scale = std::numeric_limits<float>::infinity();
  for (Camera& camera : view.rig.cameras) {
    const float scale = static_cast<float>(kCameraWidth_px) / static_cast<float>(camera.width_px);
    const int height_px = std::max(1, static_cast<int>(std::lround(scale * static_cast<float>(camera.height_px))));
    const float scale_y = static_cast<float>(height_px) / static_cast<float>(camera.height_px);
    camera.width_px = kCameraWidth_px;
    camera.height_px = height_px;
    camera.focal_x_px *= scale;
    camera.center_x_px *= scale;
    camera.focal_y_px *= scale_y;
    camera.center_y_px *= scale_y;
    line_scale = std::min(line_scale, scale);
  }
  // All cameras have the line width that suits the widest camera.
  view.line_floor_px = std::min(view.line_floor_px * line_scale, kMaxLineFloor_px);
  return view;
}

std::vector<int> film_order(const Rig& rig) {
  std::vector<int> order(rig.cameras.size());
  std::iota(order.begin(), order.end(), 0);
  const auto yaw = [&rig](int camera) { return wrap_angle(rig.cameras[camera].yaw_rad); };
  const auto looks_back = [&yaw](int camera) { return std::abs(yaw(camera)) > 0.75f * kPi; };
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return looks_back(a) != looks_back(b) ? looks_back(b) : yaw(a) > yaw(b); });
  return order;
}

struct Film::Parts {
  Parts(const std::string& path, const Simulator& simulator, const FilmOptions& options)
      : agent(options.agent),
        width_m(options.width_m),
        painter(*simulator.maps()[0]->road, kTopWidth_px, kTopHeight_px, simulator.maps()[0]->geometry.walls,
                simulator.maps()[0]->scenario.get()),
        renderer(make_renderer("cpu", view_of(options))),
        order(film_order(renderer->config().rig)),
        images(renderer->config().rig, 1),
        row_px(kCameraGap_px + row_height_px(images, renderer->config().rig)),
        frame{kTopWidth_px, kTopHeight_px + (static_cast<int>(order.size()) + kColumns - 1) / kColumns * row_px, {}},
        video(path, frame.width_px, frame.height_px, kFramesPerSecond) {
    frame.rgb.assign(static_cast<size_t>(frame.width_px) * static_cast<size_t>(frame.height_px) * 3, kGapGrey);
    upload_maps(simulator, renderer.get());
  }

  int agent;
  float width_m;
  WorldPainter painter;
  std::unique_ptr<Renderer> renderer;
  std::vector<int> order;  // indices of the cameras
  HostImages images;
  int row_px;  // height of a row of cameras, including the gap above it
  RgbImage frame;
  VideoWriter video;
};

Film::Film(const std::string& path, const Simulator& simulator, const FilmOptions& options)
    : parts_(std::make_unique<Parts>(path, simulator, options)) {}

Film::~Film() = default;

void Film::add_frame(Simulator& simulator) {
  Parts& parts = *parts_;
  const std::string caption =
      fmt::format("{}  episode {}  {:.1f} s  agent {}", simulator.maps()[0]->road->name, simulator.episode_index()[0],
                  simulator.config().dt_s * static_cast<float>(simulator.episode_step()[0]), parts.agent);
  const RgbImage top = draw_world(parts.painter, simulator, 0, parts.agent, parts.width_m, caption);
  paste(top, 0, 0, &parts.frame);
  parts.renderer->render(simulator.scene(), simulator.views().subspan(parts.agent, 1), parts.images.batch());
  if (!has_body(simulator.state().status[parts.agent])) std::ranges::fill(parts.images.bytes(), uint8_t{0});
  for (size_t i = 0; i < parts.order.size(); ++i) {
    const int camera = parts.order[i], column = static_cast<int>(i) % kColumns, row = static_cast<int>(i) / kColumns;
    const std::string& name = parts.renderer->config().rig.cameras[camera].name;
    paste(captioned(parts.images, 0, camera, name), column * (kCameraWidth_px + kCameraGap_px),
          kTopHeight_px + kCameraGap_px + row * parts.row_px, &parts.frame);
  }
  parts.video.add(parts.frame);
}

void Film::close() { parts_->video.finish(); }

}  // namespace pictura
