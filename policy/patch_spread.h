// Spreads the first convolution of a policy for larger images. Patches grow with the images, and the weight of a pixel
// is spread over the pixels that replace it. The policy computes the same function, with the same number of tokens.
#pragma once

#include <cstdint>

#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Name of the weight [out, 3 patch_px^2, kernel, kernel] of the first convolution in policies and files.
inline constexpr const char* kFirstConvolution = "conv.0.weight";

/// Side in px of the patches that a first convolution with this number of input channels reads.
int patch_side_px(int64_t channels);

/// Returns the weight [out, 3 p^2, kernel, kernel] over patches of k p px: weight[o, c, y, x] / k^2 at each position
/// [o, c, k y + i, k x + j], i and j below k. For an image that is constant in blocks of k x k px, the features equal
/// those of `weight` for the image with one pixel per block.
StoredTensor spread_over_patches(const StoredTensor& weight, int factor);

/// Returns the weight, or Adam's moments of a weight, repeated without division at each position of
/// spread_over_patches(). Spread weights inherit the Adam moments of their source weight. A feature is a sum of w x
/// over pixels; if a block is constant, each of its k^2 weights has the gradient dL/dw of the source weight. So the
/// moments of each weight, and its direction m / sqrt(v), equal those of the source weight. Together the k^2 weights
/// move the feature k^2 times as far: see rate_factor_of_spread().
StoredTensor repeat_over_patches(const StoredTensor& weight, int factor);

/// Learning-rate factor of spread weights: 1 / k^2, with which a step moves the features as far as before the spread.
/// Weight decay keeps the full rate, since it scales the sum of the spread weights by the same factor as each weight.
/// In the gradient norm the k^2 equal gradients count as one, so that clipping is unchanged.
constexpr double rate_factor_of_spread(int factor) { return 1.0 / (double(factor) * factor); }

}  // namespace pictura
