// Reference for measurements of renderers: a small ray caster in double precision. Every pixel is the box filter of the
// nearest drawn primitive, by point samples. It shares with the renderers the colours, the brightness, the outlines and
// ranks of strips, and the constants of docs/explanation/image.md. It does not share widening, clipping, projection,
// coverage or visibility.
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
  grid_2x2,              // 2x2 supersampling of a z-buffer
  center,                // one sample per pixel of a z-buffer
};

/// Traces one camera's image of one view of a host scene with one geometry for all worlds.
TruthImage trace_image(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
                       float line_floor_px, TruthSamples samples = TruthSamples::low_discrepancy_1024);

/// Visibility of an agent: the samples in which it is in front of everything over the samples in which it would be seen
/// alone, summed over the rig's cameras. `alone_px` counts the samples in which it would be seen alone, in pixels.
/// `share` is NaN if the agent is in no image.
struct TruthVisibility {
  double share = 0, alone_px = 0;
};
TruthVisibility trace_visibility(const StaticGeometry& geometry, const SceneBatch& scene, const View& view,
                                 const Rig& rig, float line_floor_px, int32_t agent);

/// Absolute difference of channel values; infinity if one is not finite, so that it exceeds every tolerance.
double value_error(double actual, double expected);

/// Whether two depths are equal within kKernelDepthError. Infinity means no surface, and equals only itself.
bool is_same_depth(double actual_m, double expected_m);

/// Pooled squared error of many images; channels in [0, 1].
class PooledError {
 public:
  PooledError() = default;
  PooledError(const std::vector<float>& image, const std::vector<float>& truth) { add(image, truth); }
  void add(const std::vector<float>& image, const std::vector<float>& truth);
  void add(const PooledError& other);
  double psnr_db() const;
  double max_error() const { return max_error_; }
  /// Share of channel values with a larger error, in steps of 1/8 of 1/255, rounded up.
  double share_above(double error) const;

 private:
  double squared_ = 0, max_error_ = 0;
  std::size_t count_ = 0;
  std::vector<std::size_t> histogram_ = std::vector<std::size_t>(8 * 255 + 1);  // counts by |error|
};

}  // namespace pictura
