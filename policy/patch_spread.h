// Adapts the first convolution of a policy to images that are larger by an integer factor k. Patches become larger by
// the same factor, and the weight of a pixel is spread over the k x k pixels that replace it. The number of tokens is
// unchanged.
#pragma once

#include <cstdint>

#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Name of the weight [out, 3 patch_px^2, kernel, kernel] of the first convolution in policies and files.
inline constexpr const char* kFirstConvolution = "conv.0.weight";

/// Returns the side in px of the patches that a first convolution with this number of input channels reads.
int patch_side_px(int64_t channels);

/// Converts `weight`, [out, 3 p^2, kernel, kernel], from patches of p px to patches of k p px, where k is `factor`. The
/// weight of color c of pixel (x, y) is divided by k^2 and stored for the pixels (k x + i, k y + j), i, j < k. If an
/// image is constant in blocks of k x k px, the new features equal those of `weight` for the image with one pixel per
/// block.
StoredTensor spread_over_patches(const StoredTensor& weight, int factor);

/// Variant of spread_over_patches() without the division by k^2. It computes Adam's moments of spread weights from
/// those of the source weight. If an image is constant in a block, each of the block's k^2 weights has the same
/// gradient as the source weight had. So the moments of each weight, and its direction m / sqrt(v), equal those of the
/// source weight. Together, the k^2 weights change the feature k^2 times as much, which rate_factor_of_spread()
/// corrects.
StoredTensor repeat_over_patches(const StoredTensor& weight, int factor);

/// Learning-rate factor of spread weights: 1 / k^2. With it, a step changes the features as much as before the spread.
/// Weight decay keeps the full rate, because it scales the sum of the spread weights by the same factor as each weight.
/// The gradient norm counts the k^2 equal gradients as one, so that clipping is unchanged.
constexpr double rate_factor_of_spread(int factor) { return 1.0 / (double(factor) * factor); }

}  // namespace pictura
