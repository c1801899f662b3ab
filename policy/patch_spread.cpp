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

StoredTensor repeat_over_patches(const StoredTensor& weight, int factor) {
  const int64_t side = patch_side_px(weight.shape.at(1)), large = side * factor;
  const int64_t of_tap = weight.shape.at(2) * weight.shape.at(3);
  StoredTensor result{weight.name, weight.shape, {}};
  result.shape[1] = 3 * large * large;
  result.values.reserve(weight.values.size() * static_cast<size_t>(factor * factor));
  for (int64_t plane = 0; plane < weight.shape[0] * 3; ++plane) {  // one plane per output and color
    for (int64_t y = 0; y < large; ++y) {
      for (int64_t x = 0; x < large; ++x) {
        const auto from = weight.values.begin() + ((plane * side + y / factor) * side + x / factor) * of_tap;
        result.values.insert(result.values.end(), from, from + of_tap);
      }
    }
  }
  return result;
}

StoredTensor spread_over_patches(const StoredTensor& weight, int factor) {
  StoredTensor result = repeat_over_patches(weight, factor);
  for (float& value : result.values) value /= static_cast<float>(factor * factor);
  return result;
}

}  // namespace pictura
