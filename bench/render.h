// Timing of renderers on scenes in their own memory space, with a check against the oracle (the CPU renderer).
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
  RendererConfig config;  // scenes, views and images are on its device
  int num_views = 0;      // first views of the driven worlds
  PixelFormat format = PixelFormat::u8;
  Planes planes = Planes::none;
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;
  int checked_views = 8;  // views to compare with the oracle
  int repeats = 7;        // 0: no timing
  double repeat_s = 1.0;  // approximate
  bool measures_memory = false;
};

struct RenderMeasurement {
  std::string choice;           // as reported by make_renderer()
  std::vector<double> call_ms;  // [repeat] mean time of a call
  ImageError error;             // checked views against the oracle
  // If measures_memory: device memory after the upload of the maps, and its peak. Excludes scene, views and images;
  // image_bytes is the size of the colour images.
  double up_front_bytes = 0, max_bytes = 0, image_bytes = 0;
};

/// Allocates host memory for num_views views.
HostImages images_of(const RenderCase& render_case, int num_views);

/// Throws Error if the images of `cuda` are out of tolerance, or if a backend cannot run on this machine.
RenderMeasurement measure_render(const DrivenWorlds& worlds, const RenderCase& render_case);

class RenderTarget {
 public:
  virtual ~RenderTarget() = default;
  virtual void fill_unwritten() = 0;
  /// Makes `calls` calls and waits. Returns the mean time of a call in milliseconds.
  virtual double draw(Renderer* renderer, int calls) = 0;
  /// Returns the images of at least num_views views.
  virtual const HostImages& images(int num_views) = 0;
};
std::unique_ptr<RenderTarget> make_host_target(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Names of the first CUDA device and its driver; empty if there is no device.
std::string cuda_device_name();
std::string cuda_driver_name();

}  // namespace pictura
