// Timing of renderers on scenes in the renderers' own memory space. Before and after timing, their images are compared
// with those of the oracle (the CPU renderer).
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
  RendererConfig config;  // config.device: device of scenes, views and images
  int num_views = 0;      // number of views: the first views of the driven worlds
  PixelFormat format = PixelFormat::u8;
  Planes planes = Planes::none;
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // side of the patches, if the order is patches
  int checked_views = 8;            // number of views to compare with the oracle; 0: none
  int repeats = 7;                  // 0: no timing
  double repeat_s = 1.0;            // approximate duration of a repeat
  bool measures_memory = false;
};

struct RenderMeasurement {
  std::string choice;           // as reported by make_renderer()
  std::vector<double> call_ms;  // mean of the calls of each repeat
  ImageError error;             // errors of the checked views against the oracle, before and after timing
  // If measures_memory is true: used device memory after the upload of the maps, and its peak. Both exclude the scene,
  // views and images.
  double up_front_bytes = 0, max_bytes = 0, image_bytes = 0;
};

/// Allocates host memory for the images of num_views views of the case.
HostImages images_of(const RenderCase& render_case, int num_views);

/// Measures a case. Throws Error if the images of `cuda` are out of tolerance, or if a backend cannot run on this
/// machine.
RenderMeasurement measure_render(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Views and their images in one memory space.
class RenderTarget {
 public:
  virtual ~RenderTarget() = default;
  /// Overwrites all images with a value that no renderer draws.
  virtual void fill_unwritten() = 0;
  /// Makes `calls` consecutive calls, waits for their end, and returns the mean time of a call in milliseconds.
  virtual double draw(Renderer* renderer, int calls) = 0;
  /// Returns the images of at least num_views views.
  virtual const HostImages& images(int num_views) = 0;
};
std::unique_ptr<RenderTarget> make_host_target(const DrivenWorlds& worlds, const RenderCase& render_case);

/// Names of the first CUDA device and of its driver; empty if there is no CUDA device.
std::string cuda_device_name();
std::string cuda_driver_name();

}  // namespace pictura
