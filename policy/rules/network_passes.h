// Operations of a network on CUDA devices besides matrix products, each with one pass over memory.
#pragma once

#include <algorithm>

#include "pictura/common/device.h"
#include "pictura/common/math.h"
#include "pictura/common/portable/hd.h"

namespace pictura {

enum class ActivationType : uint8_t { f32, bf16 };

/// Constant that layer norms add to the variance.
constexpr float kNormEpsilon = 1e-5f;

/// Size and type of contiguous activations [rows, channels]. Parameters and their gradients are f32. All arrays must
/// begin at multiples of 16 bytes.
struct ActivationSize {
  ActivationType type = ActivationType::f32;
  int64_t rows = 0, channels = 0;
};

/// Sizes for converting images u8 [views, cameras, 3, height_px, width_px] to patches [cameras, views, rows, columns,
/// channels]. Channel (c * patch_px + y) * patch_px + x is color c (0 to 255) of pixel (x, y) of the patch; further
/// channels are 0. Black pixels complete the last patches.
struct PatchSize {
  int64_t views = 0, cameras = 0, height_px = 0, width_px = 0, patch_px = 1;
  static constexpr bool supports(int64_t patch_px) { return (patch_px >= 1 && patch_px <= 4) || patch_px == 6; }
  /// Channels of a patch, rounded up to a multiple of 8 for matrix units.
  PICTURA_HD static constexpr int64_t channels_of(int64_t patch_px) { return (3 * patch_px * patch_px + 7) / 8 * 8; }
  PICTURA_HD int64_t rows() const { return (height_px + patch_px - 1) / patch_px; }
  PICTURA_HD int64_t columns() const { return (width_px + patch_px - 1) / patch_px; }
};

/// Columns of a segment's row (docs/reference/observation.md).
struct SegmentColumn {
  static constexpr int kCos = 4, kSin = 5;  // direction of the segment
};

/// Features of a row (policy/row_features.h). A row begins with `points` pairs (x, y). Each pair has kOfPoint features;
/// of_segment adds kOfSegment.
struct RowFeatures {
  int points = 0;
  bool of_segment = false;
  float position_unit_m = 1;  // unit of x and y
  static constexpr int kOfPoint = 6, kOfSegment = 4;
  PICTURA_HD constexpr int count() const { return points * kOfPoint + (of_segment ? kOfSegment : 0); }
};

/// Size of contiguous f32 rows and their features. keeps_rows: each row precedes its features in the result.
struct RowSize {
  int64_t rows = 0, columns = 0;
  RowFeatures features;
  bool keeps_rows = false;
  PICTURA_HD int64_t kept() const { return keeps_rows ? columns : 0; }
  PICTURA_HD int64_t width() const { return kept() + features.count(); }
  static constexpr int64_t kMaxWidth = 256;
};

constexpr float kNearPoint_m = 4.0f, kFarPoint_m = 20.0f, kPointDirection_m = 1.0f;

PICTURA_HD inline float point_feature(Vec2 point_m, int feature) {
  const float its_m = feature % 2 == 0 ? point_m.x : point_m.y;
  if (feature >= 4) return its_m / (length(point_m) + kPointDirection_m);
  return its_m / (fabsf(its_m) + (feature < 2 ? kNearPoint_m : kFarPoint_m));
}

/// Returns the agent's position in m relative to a segment: x along it from its middle, y to its left.
PICTURA_HD inline Vec2 beside_segment(const RowFeatures& features, const float* row) {
  const Vec2 from_middle_m = Vec2{} - Vec2{row[0], row[1]} * features.position_unit_m,
             direction{row[SegmentColumn::kCos], row[SegmentColumn::kSin]};
  return {dot(from_middle_m, direction), cross(direction, from_middle_m)};
}

PICTURA_HD inline float row_feature(const RowFeatures& features, const float* row, int feature) {
  const int of_points = features.points * RowFeatures::kOfPoint;
  if (feature >= of_points) return point_feature(beside_segment(features, row), feature - of_points);
  const float* const xy = row + 2 * (feature / RowFeatures::kOfPoint);
  return point_feature(Vec2{xy[0], xy[1]} * features.position_unit_m, feature % RowFeatures::kOfPoint);
}

/// Sizes for the encoder of entity sets: linear layer, normalization (if has_norm), GELU, and second linear layer, with
/// `channels` outputs each.
struct SetSize {
  RowSize members;  // max_members rows per set; keeps_rows is true
  int64_t max_members = 0;
  int64_t counts_stride = 1;  // elements from one set's count to the next
  bool has_norm = false;
  int64_t channels = 64;
  static constexpr int kMaxWidth = 31, kMaxMembers = 254, kNoMember = 255;
  PICTURA_HD int64_t sets() const { return members.rows / max_members; }
  static constexpr bool supports(int64_t channels, int64_t hidden_channels, int64_t width, int64_t max_members) {
    return (channels == 64 || channels == 128) && hidden_channels == channels && width <= kMaxWidth &&
           max_members >= 1 && max_members <= kMaxMembers;
  }
  /// Number of partial sums of each gradient.
  static constexpr int64_t kSums = 264;
};

/// Parameters of SetSize's layers, or arrays of their shapes: hidden_weight [channels, members.width()], weight
/// [channels, channels], biases [channels].
template <typename Number>
struct SetParameters {
  Number *hidden_weight, *hidden_bias, *weight, *bias;
};

/// Size of attention scores [matrices, tokens, columns]. The number of columns is even.
struct TokenSize {
  ActivationType type = ActivationType::f32;
  int64_t matrices = 0, tokens = 0, columns = 0;
};

/// Interface of the operations, which enqueue work on device arrays. Objects have no state. Sums over rows have a fixed
/// order, so results are reproducible.
class NetworkPasses {
 public:
  NetworkPasses() = default;
  virtual ~NetworkPasses() = default;
  NetworkPasses(const NetworkPasses&) = delete;
  NetworkPasses& operator=(const NetworkPasses&) = delete;

  /// supports_gelu(): whether bias_gelu() supports this number of channels; supports_norm(): whether norm() and
  /// bias_norm_gelu() do.
  static constexpr bool supports_gelu(int64_t channels) { return channels % 8 == 0 && channels <= 1024; }
  static constexpr bool supports_norm(int64_t channels) {
    return channels % 64 == 0 && channels <= 512 && channels != 320 && channels != 448;
  }

  /// Computes out = GELU(x + bias) with the error function.
  virtual void bias_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, Stream stream) = 0;
  /// Computes the gradient of x, and partial sums [kBiasSums, channels] of the bias's gradient, which the caller adds.
  virtual void bias_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                                  void* grad_x_out, float* grad_bias_sums_out, Stream stream) = 0;
  static constexpr int64_t kBiasSums = 528;

  /// Computes out = GELU(layer norm of (x + bias)) over channels, without parameters, with kNormEpsilon.
  virtual void bias_norm_gelu(const ActivationSize& size, const void* x, const float* bias, void* out,
                              Stream stream) = 0;
  /// Computes the gradient of x, and partial sums [num_norm_sums(rows, 1), channels] of the bias's gradient.
  virtual void bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias,
                                       const void* grad_out, void* grad_x_out, float* grad_bias_sums_out,
                                       Stream stream) = 0;

  /// Computes out = layer norm of (x + position) over channels, with kNormEpsilon. position: [period, channels],
  /// where row r uses position r % period; or null with a period of 1.
  virtual void norm(const ActivationSize& size, const void* x, const void* position, int64_t period,
                    const float* weight, const float* bias, void* out, Stream stream) = 0;
  /// Computes the gradient of x, and partial sums [num_norm_sums(rows, period), period, 3, channels] of the gradients
  /// of position, weight and bias.
  virtual void norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                             const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                             Stream stream) = 0;
  static constexpr int64_t num_norm_sums(int64_t rows, int64_t period) {
    return std::clamp<int64_t>((8448 + period - 1) / period, 1, std::max<int64_t>(1, rows / period));
  }

  /// Computes features. out: [size.rows, size.width()], at most RowSize::kMaxWidth wide.
  virtual void row_features(const RowSize& size, const float* rows, ActivationType type, void* out, Stream stream) = 0;

  virtual void patches(const PatchSize& size, const uint8_t* images, ActivationType type, void* out, Stream stream) = 0;

  /// Whether the device has enough shared memory for the next two functions with this number of channels.
  virtual bool fits_set_encoder(int64_t channels) const = 0;
  /// Embeds the members of entity sets in bf16, and finds each channel's largest value in a set. out: bf16 [sets,
  /// channels], 0 for an empty set. which_out: [sets, channels], index of the first member with this value, or
  /// kNoMember; may be null. counts: members of each set.
  virtual void largest_embedding(const SetSize& size, const float* members, const int32_t* counts,
                                 const SetParameters<const float>& parameters, void* out, uint8_t* which_out,
                                 Stream stream) = 0;
  /// Computes the parameters' gradients as partial sums [kSums, ...] from the gradient of `out` (bf16).
  virtual void largest_embedding_backward(const SetSize& size, const float* members,
                                          const SetParameters<const float>& parameters, const uint8_t* which,
                                          const void* grad_out, const SetParameters<float>& sums_out,
                                          Stream stream) = 0;

  /// Computes out = softmax over tokens.
  virtual void token_softmax(const TokenSize& size, const void* scores, void* out, Stream stream) = 0;
  virtual void token_softmax_backward(const TokenSize& size, const void* out, const void* grad_out,
                                      void* grad_scores_out, Stream stream) = 0;
};

}  // namespace pictura
