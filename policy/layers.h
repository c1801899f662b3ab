// Layers of the policies, fused with the operations that follow them, such as GELU. On a CUDA device, these operations
// are one pass over memory if their sizes are supported (rules/network_passes.h). On the host in fp32, they run in
// blocks that fit a core's cache (host_passes.h). In all other cases, ATen computes them. All layers are differentiable
// unless a comment says otherwise.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Returns GELU(linear layer of x). x: [..., in]; weight: [out, in]; bias: [out].
at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Returns the layer norm of x over the last dimension, without parameters. The result has the type of x, even under
/// autocast.
at::Tensor normalize(const at::Tensor& x);

/// Returns GELU(normalize(linear layer of x)). Shapes as in linear_gelu().
at::Tensor linear_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Returns GELU(convolution of x), where x is padded by half the kernel. x: [n, in, height, width]; weight: [out, in,
/// kernel, kernel]; bias: [out]. The weight may have fewer input channels than x if the additional channels of x are 0.
at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride);

/// Returns the layer norm of (x + position) over the last dimension. x: [..., period, channels]; position: [period,
/// channels], or undefined for none; weight, bias: [channels].
at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias);

/// Whether largest_embedding() supports these members and layers. The host supports all. A CUDA device supports f32
/// members if layers compute in bf16 and SetSize::supports() accepts their sizes.
bool has_fused_set_encoder(const at::Tensor& members, const RowFeatures& features, const at::Tensor& hidden_weight,
                           const at::Tensor& weight);
/// Embeds all members of entity sets and returns the largest value of each channel over the members of a set: [sets,
/// channels], 0 for an empty set. Two layers embed a member and its features: linear_gelu() (linear_norm_gelu() if
/// `has_norm`) and a linear layer. members: [sets, maximum, columns], which get no gradient; counts: i32 [sets], the
/// number of members of each set.
at::Tensor largest_embedding(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                             bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                             const at::Tensor& weight, const at::Tensor& bias);

/// Returns the softmax over tokens. scores: [matrices, tokens, columns].
at::Tensor token_softmax(const at::Tensor& scores);

/// Whether feature_rows() supports these rows, [..., columns]: they must be f32, be on a CUDA device, and have at most
/// RowSize::kMaxWidth columns together with their features.
bool has_fused_row_features(const at::Tensor& rows, const RowFeatures& features);
/// Returns the features of rows, [..., columns], see row_features.h. With `keeps_rows`, the row itself precedes its
/// features. The result has this `type` and no gradient.
at::Tensor feature_rows(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows, at::ScalarType type);

/// Converts images to patches, without gradient. images: u8 [views, cameras, 3, height, width], padded with black to
/// whole patches; result: [cameras * views, channels, height / patch_px, width / patch_px] of `type`, with channels
/// last in memory. The value (0 to 255) of color c of pixel (x, y) of a patch becomes channel (c * patch_px + y) *
/// patch_px + x; further channels are 0.
at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type);

}  // namespace pictura
