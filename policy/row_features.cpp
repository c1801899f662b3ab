#include "pictura/policy/row_features.h"

#include "pictura/policy/layers.h"

namespace pictura {

namespace {

// Converts pairs of coordinates [..., 2] in metres to four numbers: two resolve near positions, and two resolve far
// positions.
at::Tensor near_and_far(const at::Tensor& pairs_m) {
  const at::Tensor size_m = pairs_m.abs();
  return at::cat({pairs_m / (size_m + double{kNearPoint_m}), pairs_m / (size_m + double{kFarPoint_m})}, -1);
}

// Returns the agent's positions [..., 2] in metres relative to segments: along each segment from its middle, and to the
// left of its line.
at::Tensor beside_segments(const at::Tensor& rows, double unit_m) {
  const at::Tensor from_middle_m = rows.narrow(-1, 0, 2) * -unit_m, direction = rows.narrow(-1, SegmentColumn::kCos, 2),
                   to_left = at::stack({-direction.select(-1, 1), direction.select(-1, 0)}, -1);
  return at::stack({(from_middle_m * direction).sum(-1), (from_middle_m * to_left).sum(-1)}, -1);
}

}  // namespace

at::Tensor row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type) {
  if (has_fused_row_features(rows, features)) return feature_rows(rows, features, /*keeps_rows=*/false, type);
  const double unit_m = features.position_unit_m;
  std::vector<at::Tensor> all;
  if (features.points > 0) {
    const at::Tensor xy_m = (rows.narrow(-1, 0, 2 * features.points) * unit_m).unflatten(-1, {features.points, 2}),
                     distance_m = xy_m.norm(2, -1, /*keepdim=*/true);
    all.push_back(at::cat({near_and_far(xy_m), xy_m / (distance_m + double{kPointDirection_m})}, -1).flatten(-2));
  }
  if (features.of_segment) all.push_back(near_and_far(beside_segments(rows, unit_m)));
  return at::cat(all, -1).to(type);
}

at::Tensor with_row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type) {
  if (has_fused_row_features(rows, features)) return feature_rows(rows, features, /*keeps_rows=*/true, type);
  return at::cat({rows.to(type), row_features(rows, features, type)}, -1);
}

}  // namespace pictura
