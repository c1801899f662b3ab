// The truth for measurements of renderers: a ray caster in double precision, which averages the colours of the nearest
// primitives at point samples. It has its own code for widening, clipping, projection, coverage and visibility.
#pragma once

#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

struct TruthImage {
  int width_px = 0, height_px = 0;
  std::vector<float> rgb;  // [3, height, width] in [0, 1]
  // Planes, [height, width], as in CameraImages:
  std::vector<float> depth_m;
  std::vector<uint8_t> class_id;
  std::vector<uint16_t> instance_id;
  bool blank() const;
};

enum class TruthSamples {
  low_discrepancy_1024,  // the truth
  grid_2x2,              // as a z-buffer with 2x2 samples
  center,                // as a z-buffer with one sample
};

/// Traces one camera's image of one view. The worlds of `scene`, on the host, share `geometry`.
TruthImage trace_image(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
                       float line_floor_px, TruthSamples samples = TruthSamples::low_discrepancy_1024);

/// Visibility of an agent, summed over the rig's cameras. alone_px: area of the samples that show the agent if it is
/// alone. share: share of these samples in which the agent is in front; NaN if the agent is in no image.
struct TruthVisibility {
  double share = 0, alone_px = 0;
};
TruthVisibility trace_visibility(const StaticGeometry& geometry, const SceneBatch& scene, const View& view,
                                 const Rig& rig, float line_floor_px, int32_t agent);

/// Absolute difference; infinity if a value is not finite.
double value_error(double actual, double expected);

/// Whether two depths are equal within a relative error of kKernelDepthError. Infinity equals only infinity.
bool is_same_depth(double actual_m, double expected_m);

/// Pooled squared error of images, with channels in [0, 1].
class PooledError {
 public:
  PooledError() = default;
  PooledError(const std::vector<float>& image, const std::vector<float>& truth) { add(image, truth); }
  void add(const std::vector<float>& image, const std::vector<float>& truth);
  void add(const PooledError& other);
  double psnr_db() const;
  double max_error() const { return max_error_; }
  /// Share of values whose error, rounded up to a multiple of 1/8 of 1/255, exceeds `error`.
  double share_above(double error) const;

 private:
  double squared_ = 0, max_error_ = 0;
  std::size_t count_ = 0;
  std::vector<std::size_t> histogram_ = std::vector<std::size_t>(8 * 255 + 1);  // number of values by |error|
};

}  // namespace pictura
