// Adaptation of a first convolution to images and patches that are larger by an integer factor k.
#pragma once

#include <cstdint>

#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Name of the first convolution's weight, [out, 3 patch_px^2, kernel, kernel].
inline constexpr const char* kFirstConvolution = "conv.0.weight";

/// Returns the side in px of patches of this many channels.
int patch_side_px(int64_t channels);

/// Converts `weight`, [out, 3 p^2, kernel, kernel], from patches of p px to patches of k p px, where k is `factor`.
/// Each weight is divided by k^2, and used for the k x k pixels that replace its pixel. Images that are constant in
/// blocks of k x k px keep their features.
StoredTensor spread_over_patches(const StoredTensor& weight, int factor);

/// Variant without the division by k^2, for Adam's moments. In images that are constant in blocks, each of the k^2
/// weights has the source weight's gradient, and therefore makes the same step. Together they change the feature k^2
/// times as much, which rate_factor_of_spread() corrects.
StoredTensor repeat_over_patches(const StoredTensor& weight, int factor);

/// Learning-rate factor of spread weights, with which a step changes features as much as before. Weight decay keeps the
/// full rate, because it scales all weights alike.
constexpr double rate_factor_of_spread(int factor) { return 1.0 / (double(factor) * factor); }

}  // namespace pictura
