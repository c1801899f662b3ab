// Layers of the policies, each with the operations that follow it. On a CUDA device these operations are one pass over
// memory (rules/network_passes.h) if the sizes allow it. On the host in fp32 they run in blocks that stay in a core's
// cache (host_passes.h). In all other cases ATen computes them. All layers are differentiable.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// GELU of a linear layer. x: [..., in]; weight: [out, in]; bias: [out].
at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Layer norm without parameters over the last dimension. The result has the type of x at every precision.
at::Tensor normalize(const at::Tensor& x);

/// GELU of a linear layer whose outputs are normalized before the GELU. Shapes as in linear_gelu().
at::Tensor linear_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// GELU of a convolution whose input is padded by half the kernel. x: [n, in, height, width]; weight: [out, in, kernel,
/// kernel], where `in` may be smaller than that of x if the last channels of x are 0; bias: [out].
at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride);

/// Layer norm of x + position over the last dimension. x: [..., period, channels]; position: [period, channels], or
/// undefined for none; weight, bias: [channels].
at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias);

/// Whether largest_embedding() supports these members and layers. The host supports all of them. A CUDA device supports
/// f32 members if it computes in bf16 and SetSize::supports() accepts the layers' sizes.
bool has_fused_set_encoder(const at::Tensor& members, const RowFeatures& features, const at::Tensor& hidden_weight,
                           const at::Tensor& weight);
/// Returns the largest value of each channel over the embeddings of a set's members: [sets, channels], 0 for an empty
/// set. A member's embedding is computed from the member and its features by a linear layer with GELU
/// (linear_norm_gelu() if `has_norm`) and a second linear layer. members: [sets, maximum, columns], without gradient;
/// counts: i32 [sets], number of members of each set.
at::Tensor largest_embedding(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                             bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                             const at::Tensor& weight, const at::Tensor& bias);

/// Softmax over tokens. scores: [matrices, tokens, columns].
at::Tensor token_softmax(const at::Tensor& scores);

/// Whether feature_rows() supports these rows, [..., columns]: they must be f32, on a CUDA device, and not too wide
/// (RowSize::kMaxWidth).
bool has_fused_row_features(const at::Tensor& rows, const RowFeatures& features);
/// Features of rows, [..., columns], as RowSize describes them, in `type`. Without gradient.
at::Tensor feature_rows(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows, at::ScalarType type);

/// Converts images, u8 [views, cameras, 3, height, width], to patches: [cameras * views, channels, height / patch_px,
/// width / patch_px] of `type`, with channels last in memory. Images are padded with black to whole patches. Color c, 0
/// to 255, of pixel (x, y) of a patch becomes channel (c * patch_px + y) * patch_px + x; further channels are 0.
/// Without gradient.
at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type);

}  // namespace pictura
