// Times renderers on scenes in the memory that they draw from, and compares what they drew with the oracle, before and
// after.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/bench/driving.h"
#include "pictura/bench/image_error.h"
#include "pictura/common/renderer.h"

namespace pictura {

struct RenderCase {
  std::string backend = "cpu";
  RendererConfig config;  // config.device: where scenes, views and images lie
  int num_views = 0;      // the first so many of the driven worlds
  PixelFormat format = PixelFormat::u8;
  Planes planes = Planes::none;
  int checked_views = 8;  // compared with the oracle, before anything is timed and after; 0: none
  int repeats = 7;        // 0: nothing is timed
  double repeat_s = 1.0;  // calls of a repeat follow each other for about as long
  bool watches_memory = false;
};

struct RenderMeasurement {
  std::string choice;           // what make_renderer() says
  std::vector<double> call_ms;  // one per repeat: the mean of its calls
  ImageError error;             // against the oracle, of the views that are checked, both times
  // Where memory is watched, of the device: once the maps are uploaded, and the most that was ever taken, both without
  // scene, views and images.
  double up_front_bytes = 0, max_bytes = 0, image_bytes = 0;
};

/// Throws Error when `cuda` draws other images than the oracle does, or a backend cannot run here.
RenderMeasurement measure_render(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Views and room for their images in the memory of one space.
class RenderTarget {
 public:
  virtual ~RenderTarget() = default;
  /// Overwrites all images with what nobody draws.
  virtual void spoil() = 0;
  /// Milliseconds of one of so many calls in a row; returns when all is drawn.
  virtual double draw(Renderer* renderer, int calls) = 0;
  /// What was drawn, of at least so many views.
  virtual const HostImages& images(int num_views) = 0;
};
std::unique_ptr<RenderTarget> make_host_target(const DrivenWorlds& worlds, const RenderCase& render_case);

/// The first CUDA device and its driver; empty where there is none.
std::string cuda_device_name();
std::string cuda_driver_name();

}  // namespace pictura
