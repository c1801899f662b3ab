#include "pictura/training/point_features.h"

#include "pictura/simulator/rules/observe.h"
#include "pictura/training/layers.h"

namespace pictura {

at::Tensor point_features(const at::Tensor& rows, int64_t points, at::ScalarType type) {
  if (takes_point_rows(rows, points)) return point_rows(rows, points, kScalePosition_m, /*keeps_rows=*/false, type);
  const at::Tensor xy_m = (rows.narrow(-1, 0, 2 * points) * double{kScalePosition_m}).unflatten(-1, {points, 2}),
                   size_m = xy_m.abs(), distance_m = xy_m.norm(2, -1, /*keepdim=*/true);
  const at::Tensor all[]{xy_m / (size_m + double{kNearPoint_m}), xy_m / (size_m + double{kFarPoint_m}),
                         xy_m / (distance_m + double{kPointDirection_m})};
  return at::cat(all, -1).flatten(-2).to(type);
}

at::Tensor with_point_features(const at::Tensor& rows, int64_t points, at::ScalarType type) {
  if (takes_point_rows(rows, points)) return point_rows(rows, points, kScalePosition_m, /*keeps_rows=*/true, type);
  return at::cat({rows.to(type), point_features(rows, points, type)}, -1);
}

}  // namespace pictura
