// Reference for measurements of renderers: a small ray caster in double precision. A pixel's colour is the mean colour
// of the nearest primitives at point samples in the pixel. The ray caster shares with the renderers the colours, the
// brightness, the outlines and ranks of strips, and the constants of docs/explanation/image.md. It has its own code for
// widening, clipping, projection, coverage and visibility.
#pragma once

#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

struct TruthImage {
  int width_px = 0, height_px = 0;
  std::vector<float> rgb;  // [3, height, width] in [0, 1]
  // Planes of the front surface at each pixel's centre, [height, width], as in CameraImages.
  std::vector<float> depth_m;
  std::vector<uint8_t> class_id;
  std::vector<uint16_t> instance_id;
  bool blank() const;
};

enum class TruthSamples {
  low_discrepancy_1024,  // the truth
  grid_2x2,              // as a z-buffer with 2x2 supersampling
  center,                // as a z-buffer with one sample per pixel
};

/// Traces one camera's image of one view of a host scene. All worlds of the scene have the same geometry.
TruthImage trace_image(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
                       float line_floor_px, TruthSamples samples = TruthSamples::low_discrepancy_1024);

/// Visibility of an agent, summed over the rig's cameras. alone_px is the area, in pixels, of the samples that show the
/// agent if it is alone. `share` is the share of these samples in which the agent is in front of everything else; NaN
/// if the agent is in no image.
struct TruthVisibility {
  double share = 0, alone_px = 0;
};
TruthVisibility trace_visibility(const StaticGeometry& geometry, const SceneBatch& scene, const View& view,
                                 const Rig& rig, float line_floor_px, int32_t agent);

/// Absolute difference of two channel values. If a value is not finite, the result is infinity, which exceeds every
/// tolerance.
double value_error(double actual, double expected);

/// Whether two depths are equal within a relative error of kKernelDepthError. Infinity means no surface, and equals
/// only infinity.
bool is_same_depth(double actual_m, double expected_m);

/// Pooled squared error of many images, with channels in [0, 1].
class PooledError {
 public:
  PooledError() = default;
  PooledError(const std::vector<float>& image, const std::vector<float>& truth) { add(image, truth); }
  void add(const std::vector<float>& image, const std::vector<float>& truth);
  void add(const PooledError& other);
  double psnr_db() const;
  double max_error() const { return max_error_; }
  /// Share of channel values whose error is larger than `error`. Errors are rounded up to multiples of 1/8 of 1/255.
  double share_above(double error) const;

 private:
  double squared_ = 0, max_error_ = 0;
  std::size_t count_ = 0;
  std::vector<std::size_t> histogram_ = std::vector<std::size_t>(8 * 255 + 1);  // number of values by |error|
};

}  // namespace pictura
