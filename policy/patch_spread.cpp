#include "pictura/policy/patch_spread.h"

#include <cmath>

#include "pictura/common/error.h"
#include "pictura/common/patches.h"

namespace pictura {

int patch_side_px(int64_t channels) {
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(channels) / 3)));
  PICTURA_CHECK(patch_values(side) == channels, "policy: {}: expected 3 p^2 inputs for patches of p px, got {}",
                kFirstConvolution, channels);
  return side;
}

at::Tensor repeat_over_patches(const at::Tensor& weight, int factor) {
  const int64_t side = patch_side_px(weight.size(1));
  return weight.unflatten(1, {3, side, side}).repeat_interleave(factor, 2).repeat_interleave(factor, 3).flatten(1, 3);
}

at::Tensor spread_over_patches(const at::Tensor& weight, int factor) {
  return repeat_over_patches(weight, factor) / (double(factor) * factor);
}

}  // namespace pictura
