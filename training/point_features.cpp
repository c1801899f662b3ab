#include "pictura/training/point_features.h"

#include "pictura/simulator/rules/observe.h"

namespace pictura {

at::Tensor point_features(const at::Tensor& rows, int64_t points) {
  const at::Tensor xy_m = (rows.narrow(-1, 0, 2 * points) * double{kScalePosition_m}).unflatten(-1, {points, 2}),
                   size_m = xy_m.abs(), distance_m = xy_m.norm(2, -1, /*keepdim=*/true);
  return at::cat({xy_m / (size_m + 4.0), xy_m / (size_m + 20.0), xy_m / (distance_m + 1.0)}, -1).flatten(-2);
}

}  // namespace pictura
