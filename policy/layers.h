// Layers of the policies, fused with the operations that follow them. CUDA devices use rules/network_passes.h, the host
// uses host_passes.h, and ATen computes unsupported sizes and types. Layers are differentiable, except where noted.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Returns GELU(linear layer). x: [..., in]; weight: [out, in]; bias: [out].
at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Returns the layer norm over the last dimension, without parameters, in the type of x.
at::Tensor normalize(const at::Tensor& x);

/// Returns GELU(normalize(linear layer)). Shapes as in linear_gelu().
at::Tensor linear_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Returns GELU(convolution), padded by half the kernel. x: [n, in, height, width]; weight: [out, in, kernel, kernel];
/// bias: [out]. The weight may lack the last input channels if x is 0 there.
at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride);
/// Returns GELU(normalize(convolution)), with the norm over channels. Shapes as in convolve_gelu().
at::Tensor convolve_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride);

/// Returns the layer norm of (x + position) over the last dimension. x: [..., period, channels]; position: [period,
/// channels], or undefined.
at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias);

/// Whether largest_embedding() supports the arguments: always on the host. A CUDA device needs f32 members, bf16
/// layers, and sizes that SetSize and its shared memory support.
bool has_fused_set_encoder(const at::Tensor& members, const RowFeatures& features, const at::Tensor& hidden_weight,
                           const at::Tensor& weight);
/// Embeds the members of entity sets, and returns each channel's largest value in a set: [sets, channels], 0 for an
/// empty set. The layers are linear_gelu() (linear_norm_gelu() if `has_norm`) on members with features, then a linear
/// layer. members: [sets, maximum, columns], without gradient; counts: i32 [sets].
at::Tensor largest_embedding(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                             bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                             const at::Tensor& weight, const at::Tensor& bias);

/// Returns the softmax over tokens. scores: [matrices, tokens, columns].
at::Tensor token_softmax(const at::Tensor& scores);

/// Whether feature_rows() supports these rows: f32, on a CUDA device, at most RowSize::kMaxWidth columns with features.
bool has_fused_row_features(const at::Tensor& rows, const RowFeatures& features);
/// Returns the features (row_features.h) of rows [..., columns], without gradient. `keeps_rows`: each row precedes its
/// features.
at::Tensor feature_rows(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows, at::ScalarType type);

/// Converts images u8 [views, cameras, 3, height, width] to patches [cameras * views, channels, rows, columns], without
/// gradient. Channels are last in memory, and ordered as in PatchSize.
at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type);

}  // namespace pictura
