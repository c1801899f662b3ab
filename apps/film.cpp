#include "pictura/apps/film.h"

#include <algorithm>

#include <fmt/format.h>

#include "pictura/apps/draw_world.h"
#include "pictura/apps/drive.h"
#include "pictura/apps/video.h"
#include "pictura/common/make_renderer.h"

namespace pictura {

namespace {

constexpr int kCameraWidth_px = 256, kCameraHeight_px = 144;
constexpr int kTopWidth_px = 4 * kCameraWidth_px, kTopHeight_px = 512;
constexpr float kFollowWidth_m = 150;
constexpr double kFramesPerSecond = 20;  // twice the pace of the world
// From left to right as a driver would look: cameras of the paper's rig.
constexpr int kCameraOrder[4] = {1, 0, 2, 3};

void paste(const std::vector<uint8_t>& rgb, int width_px, int height_px, int left_px, int top_px, RgbImage* image_out) {
  for (int y = 0; y < height_px; ++y) {
    std::copy_n(rgb.begin() + y * width_px * 3, width_px * 3,
                image_out->rgb.begin() + ((top_px + y) * image_out->width_px + left_px) * 3);
  }
}

}  // namespace

struct Film::Parts {
  Parts(const std::string& path, const Simulator& simulator, int followed_agent, int num_threads)
      : agent(followed_agent),
        painter(*simulator.maps()[0], kTopWidth_px, kTopHeight_px),
        renderer(
            make_renderer("cpu", {.rig = paper_rig(kCameraWidth_px, kCameraHeight_px), .num_threads = num_threads})),
        images(renderer->config().rig, 1),
        frame{kTopWidth_px, kTopHeight_px + kCameraHeight_px, {}},
        video(path, frame.width_px, frame.height_px, kFramesPerSecond) {
    frame.rgb.resize(static_cast<size_t>(frame.width_px) * static_cast<size_t>(frame.height_px) * 3);
    upload_geometries(simulator.geometries(), renderer.get());
  }

  int agent;
  WorldPainter painter;
  std::unique_ptr<Renderer> renderer;
  HostImages images;
  RgbImage frame;
  VideoWriter video;
};

Film::Film(const std::string& path, const Simulator& simulator, int agent, int num_threads)
    : parts_(std::make_unique<Parts>(path, simulator, agent, num_threads)) {}

Film::~Film() = default;

void Film::add_frame(Simulator& simulator) {
  Parts& parts = *parts_;
  const std::string caption = fmt::format("{:.1f} s", 0.1 * simulator.episode_step()[0]);
  const RgbImage top = draw_world(parts.painter, simulator, 0, parts.agent, kFollowWidth_m, caption);
  paste(top.rgb, top.width_px, top.height_px, 0, 0, &parts.frame);
  parts.renderer->render(simulator.scene(), simulator.views().subspan(static_cast<size_t>(parts.agent), 1),
                         parts.images.batch());
  for (int column = 0; column < 4; ++column) {
    paste(parts.images.interleaved(0, kCameraOrder[column]), kCameraWidth_px, kCameraHeight_px,
          column * kCameraWidth_px, kTopHeight_px, &parts.frame);
  }
  parts.video.add(parts.frame);
}

void Film::close() { parts_->video.finish(); }

}  // namespace pictura
