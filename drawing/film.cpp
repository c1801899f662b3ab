#include "pictura/drawing/film.h"

#include <algorithm>

#include <fmt/format.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/video.h"
#include "pictura/drawing/world.h"

namespace pictura {

namespace {

constexpr int kCameraWidth_px = 250, kCameraHeight_px = 140, kGap_px = 8;
constexpr int kTopWidth_px = 4 * kCameraWidth_px + 3 * kGap_px, kTopHeight_px = 512;
constexpr uint8_t kGapGrey = 40;
constexpr double kFramesPerSecond = 20;  // twice the pace of the world
// From left to right as a driver would look, then back: cameras of the paper's rig.
constexpr int kCameraOrder[4] = {1, 0, 2, 3};

void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out) {
  for (int y = 0; y < picture.height_px; ++y) {
    std::copy_n(picture.rgb.begin() + y * picture.width_px * 3, picture.width_px * 3,
                image_out->rgb.begin() + ((top_px + y) * image_out->width_px + left_px) * 3);
  }
}

}  // namespace

struct Film::Parts {
  Parts(const std::string& path, const Simulator& simulator, int followed_agent, float shown_width_m, int num_threads)
      : agent(followed_agent),
        width_m(shown_width_m),
        painter(*simulator.maps()[0]->road, kTopWidth_px, kTopHeight_px, simulator.maps()[0]->geometry.walls),
        renderer(
            make_renderer("cpu", {.rig = paper_rig(kCameraWidth_px, kCameraHeight_px), .num_threads = num_threads})),
        images(renderer->config().rig, 1),
        frame{kTopWidth_px, kTopHeight_px + kGap_px + captioned(images, 0, 0, "").height_px, {}},
        video(path, frame.width_px, frame.height_px, kFramesPerSecond) {
    frame.rgb.assign(static_cast<size_t>(frame.width_px) * static_cast<size_t>(frame.height_px) * 3, kGapGrey);
    upload_maps(simulator, renderer.get());
  }

  int agent;
  float width_m;
  WorldPainter painter;
  std::unique_ptr<Renderer> renderer;
  HostImages images;
  RgbImage frame;
  VideoWriter video;
};

Film::Film(const std::string& path, const Simulator& simulator, int agent, float width_m, int num_threads)
    : parts_(std::make_unique<Parts>(path, simulator, agent, width_m, num_threads)) {}

Film::~Film() = default;

void Film::add_frame(Simulator& simulator) {
  Parts& parts = *parts_;
  const std::string caption =
      fmt::format("{}  episode {}  {:.1f} s  agent {}", simulator.maps()[0]->road->name, simulator.episode_index()[0],
                  simulator.config().dt_s * static_cast<float>(simulator.episode_step()[0]), parts.agent);
  const RgbImage top = draw_world(parts.painter, simulator, 0, parts.agent, parts.width_m, caption);
  paste(top, 0, 0, &parts.frame);
  parts.renderer->render(simulator.scene(), simulator.views().subspan(static_cast<size_t>(parts.agent), 1),
                         parts.images.batch());
  for (int column = 0; column < 4; ++column) {
    const int camera = kCameraOrder[column];
    const std::string& name = parts.renderer->config().rig.cameras[static_cast<size_t>(camera)].name;
    paste(captioned(parts.images, 0, camera, name), column * (kCameraWidth_px + kGap_px), kTopHeight_px + kGap_px,
          &parts.frame);
  }
  parts.video.add(parts.frame);
}

void Film::close() { parts_->video.finish(); }

}  // namespace pictura
