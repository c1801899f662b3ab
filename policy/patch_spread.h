// The first convolution of a policy at larger images: patches grow as the images do, and the weights of a pixel are
// spread over the pixels that take its place. So the policy computes what it did, with as many tokens.
#pragma once

#include <ATen/ATen.h>

namespace pictura {

/// Name of the weight [out, 3 patch_px^2, kernel, kernel] of the first convolution, as policies and files have it.
inline constexpr const char* kFirstConvolution = "conv.0.weight";

/// Side in px of the patches that a first convolution of so many input channels takes.
int patch_side_px(int64_t channels);

/// The weight [out, 3 p^2, kernel, kernel] over patches of k p px: weight[o, c, y, x] / k^2 at each of the places
/// [o, c, k y + i, k x + j], i and j below k. Images that are constant in blocks of k x k px give the features that
/// `weight` gives of one pixel a block.
at::Tensor spread_over_patches(const at::Tensor& weight, int factor);

/// The weight, or what Adam keeps of it, at each place of spread_over_patches(), undivided. Adam's moments of weights
/// that are spread are those of the weight that each comes from: a feature is a sum of w x over pixels; where a block
/// is constant, each of its k^2 weights has the gradient dL/dw that the one weight had, so its moments, and its
/// direction m / sqrt(v), are those of the one weight. Together they move the feature k^2 times as far: see
/// rate_factor_of_spread().
at::Tensor repeat_over_patches(const at::Tensor& weight, int factor);

/// Factor of the learning rate of weights that are spread: 1 / k^2, by which a step moves the features as far as it
/// moved them before. Weight decay keeps the whole rate, since it scales the sum as it scales each weight. In the
/// gradient's norm k^2 equal gradients count as one, so that it is clipped as before.
constexpr double rate_factor_of_spread(int factor) { return 1.0 / (double(factor) * factor); }

}  // namespace pictura
