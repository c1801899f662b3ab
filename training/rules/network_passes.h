// What a network does to its activations between matrix products, each in one pass over memory where ATen takes
// several. For CUDA devices: the host's are in training/host_passes.h.
#pragma once

#include <algorithm>

#include "pictura/common/device.h"
#include "pictura/common/math.h"
#include "pictura/common/portable/hd.h"

namespace pictura {

enum class ActivationType : uint8_t { f32, bf16 };

/// Activations of `rows` positions without gaps; `type` is that of all arrays of a call but parameters and their
/// gradients, which are f32. The memory begins at a multiple of 16 bytes.
struct ActivationSize {
  ActivationType type = ActivationType::f32;
  int64_t rows = 0, channels = 0;
};

/// How images become what the first convolution reads: a patch of patch_px^2 pixels, rounded up with black, becomes one
/// position whose channel (c * patch_px + y) * patch_px + x is color c of pixel (x, y) of the patch; channels beyond
/// those of the image are 0. From u8 [views, cameras, 3, height_px, width_px] to
/// [cameras, views, rows, columns, channels], the colors from 0 to 255.
struct PatchSize {
  int64_t views = 0, cameras = 0, height_px = 0, width_px = 0, patch_px = 1;
  static constexpr bool takes(int64_t patch_px) { return patch_px >= 1 && patch_px <= 4; }
  /// Of a position: whole vectors of 8, which matrix units want.
  PICTURA_HD static constexpr int64_t channels_of(int64_t patch_px) { return (3 * patch_px * patch_px + 7) / 8 * 8; }
  PICTURA_HD int64_t rows() const { return (height_px + patch_px - 1) / patch_px; }
  PICTURA_HD int64_t columns() const { return (width_px + patch_px - 1) / patch_px; }
};

/// Where a segment's row (docs/observation.md) holds what features are made of, after the x and y of its middle.
struct SegmentColumn {
  static constexpr int kCos = 4, kSin = 5;  // of its direction
};

/// Features that are read of a row beside its numbers (see training/row_features.h): those of each of the `points`
/// pairs (x, y) that the row begins with, and those of a segment where the row is one.
struct RowFeatures {
  int points = 0;
  bool of_segment = false;
  float position_unit_m = 1;  // of x and y
  static constexpr int kOfPoint = 6, kOfSegment = 4;
  PICTURA_HD constexpr int count() const { return points * kOfPoint + (of_segment ? kOfSegment : 0); }
};

/// Rows of f32 without gaps that become their features, each behind the row itself where keeps_rows says so.
struct RowSize {
  int64_t rows = 0, columns = 0;
  RowFeatures features;
  bool keeps_rows = false;
  PICTURA_HD int64_t kept() const { return keeps_rows ? columns : 0; }
  PICTURA_HD int64_t width() const { return kept() + features.count(); }
  static constexpr int64_t kMostWidth = 256;
};

/// What is added to what lengths are divided by (see training/row_features.h).
constexpr float kNearPoint_m = 4.0f, kFarPoint_m = 20.0f, kPointDirection_m = 1.0f;

/// A feature of a point in metres. The first four are of x and y alone.
PICTURA_HD inline float point_feature(Vec2 point_m, int feature) {
  const float its_m = feature % 2 == 0 ? point_m.x : point_m.y;
  return its_m / (feature < 2   ? fabsf(its_m) + kNearPoint_m
                  : feature < 4 ? fabsf(its_m) + kFarPoint_m
                                : length(point_m) + kPointDirection_m);
}

/// A place relative to the segment of a row, in metres: x along the segment from its middle, y to the left of its line.
PICTURA_HD inline Vec2 beside_segment(const RowFeatures& features, const float* row, Vec2 place_m) {
  const Vec2 from_middle_m = place_m - Vec2{row[0], row[1]} * features.position_unit_m,
             direction{row[SegmentColumn::kCos], row[SegmentColumn::kSin]};
  return {dot(from_middle_m, direction), cross(direction, from_middle_m)};
}

/// One of the features of a row.
PICTURA_HD inline float row_feature(const RowFeatures& features, const float* row, int feature) {
  const int of_points = features.points * RowFeatures::kOfPoint;
  if (feature >= of_points) return point_feature(beside_segment(features, row, Vec2{}), feature - of_points);
  const float* const point = row + 2 * (feature / RowFeatures::kOfPoint);
  return point_feature(Vec2{point[0], point[1]} * features.position_unit_m, feature % RowFeatures::kOfPoint);
}

/// Matrices [matrices, tokens, columns] of scores; `columns` is even.
struct TokenSize {
  ActivationType type = ActivationType::f32;
  int64_t matrices = 0, tokens = 0, columns = 0;
};

/// Holds no state. Work is put on the stream, all memory is the device's. Sums over rows are in a fixed order.
class NetworkPasses {
 public:
  NetworkPasses() = default;
  virtual ~NetworkPasses() = default;
  NetworkPasses(const NetworkPasses&) = delete;
  NetworkPasses& operator=(const NetworkPasses&) = delete;

  /// Whether bias_gelu() takes rows of so many channels, and norm() and bias_norm_gelu().
  static constexpr bool gelu_takes(int64_t channels) { return channels % 8 == 0 && channels <= 1024; }
  static constexpr bool norm_takes(int64_t channels) {
    return channels % 64 == 0 && channels <= 512 && channels != 320 && channels != 448;
  }

  /// out = GELU(x + bias), by the error function. bias: [channels].
  virtual void bias_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, Stream stream) = 0;
  /// The gradients of x and, as partial sums [kBiasSums, channels], of the bias.
  virtual void bias_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                                  void* grad_x_out, float* grad_bias_sums_out, Stream stream) = 0;
  static constexpr int64_t kBiasSums = 528;

  /// out = GELU(layer norm of x + bias), whose norm is over channels and has no parameters and an epsilon of 1e-5.
  virtual void bias_norm_gelu(const ActivationSize& size, const void* x, const float* bias, void* out,
                              Stream stream) = 0;
  /// The gradients of x and, as partial sums [num_norm_sums(rows, 1), channels], of the bias.
  virtual void bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias,
                                       const void* grad_out, void* grad_x_out, float* grad_bias_sums_out,
                                       Stream stream) = 0;

  /// out = layer norm of x + position, over channels, with an epsilon of 1e-5. weight, bias: [channels]; position
  /// [period, channels] is that of row r in r % period, null for none (then period is 1).
  virtual void norm(const ActivationSize& size, const void* x, const void* position, int64_t period,
                    const float* weight, const float* bias, void* out, Stream stream) = 0;
  /// The gradients of x and, as partial sums [num_norm_sums(rows, period), period, 3, channels], of position, weight
  /// and bias.
  virtual void norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                             const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                             Stream stream) = 0;
  static constexpr int64_t num_norm_sums(int64_t rows, int64_t period) {
    return std::clamp<int64_t>((8448 + period - 1) / period, 1, std::max<int64_t>(1, rows / period));
  }

  /// out: [rows, width()], at most kMostWidth wide.
  virtual void row_features(const RowSize& size, const float* rows, ActivationType type, void* out, Stream stream) = 0;

  virtual void patches(const PatchSize& size, const uint8_t* images, ActivationType type, void* out, Stream stream) = 0;

  /// out = softmax over tokens; and the gradient of scores by way of `out`.
  virtual void token_softmax(const TokenSize& size, const void* scores, void* out, Stream stream) = 0;
  virtual void token_softmax_backward(const TokenSize& size, const void* out, const void* grad_out,
                                      void* grad_scores_out, Stream stream) = 0;
};

}  // namespace pictura
