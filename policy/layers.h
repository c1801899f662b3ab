// The layers that the policies are made of, each with what follows it. On a CUDA device what follows is one pass over
// memory (rules/network_passes.h) where the sizes allow it, on the host in fp32 it is done in blocks that stay in a
// core's cache (host_passes.h); else it is what ATen does. All are differentiable.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// GELU of a linear layer. x: [..., in]; weight: [out, in]; bias: [out].
at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// Layer norm without parameters over the last dimension, in the type of x at any precision.
at::Tensor normalize(const at::Tensor& x);

/// GELU of a linear layer whose outputs are normalized before it. Shapes as those of linear_gelu().
at::Tensor linear_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias);

/// GELU of a convolution whose input is padded by half the kernel. x: [n, in, height, width]; weight: [out, in, kernel,
/// kernel], or with fewer inputs where the last channels of x are 0; bias: [out].
at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride);

/// Layer norm of x + position over the last dimension. x: [..., period, channels]; position: [period, channels], or
/// undefined for none; weight, bias: [channels].
at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias);

/// Whether largest_embedding() takes such members: f32 on the host, or on a CUDA device that computes in bf16, for
/// layers as SetSize has them.
bool takes_sets(const at::Tensor& members, const RowFeatures& features, const at::Tensor& hidden_weight,
                const at::Tensor& weight);
/// Largest value of each channel over the members of a set: [sets, channels], 0 for an empty set. Each member goes
/// through a linear layer with GELU, as linear_norm_gelu() with `has_norm`, and a second linear layer. members: [sets,
/// maximum, columns], without gradient, each followed by its features; counts: i32 [sets], the members of each set.
at::Tensor largest_embedding(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                             bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                             const at::Tensor& weight, const at::Tensor& bias);

/// Softmax over tokens. scores: [matrices, tokens, columns].
at::Tensor token_softmax(const at::Tensor& scores);

/// Whether feature_rows() takes such rows, [..., columns]: f32 on a CUDA device, few enough numbers a row.
bool takes_feature_rows(const at::Tensor& rows, const RowFeatures& features);
/// What RowSize says of rows, [..., columns], as `type`. Without gradient.
at::Tensor feature_rows(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows, at::ScalarType type);

/// Patches of images, u8 [views, cameras, 3, height, width], as pixels of [cameras * views, channels, height /
/// patch_px, width / patch_px] of `type`, rounded up with black, channels last in memory: channel (c * patch_px + y) *
/// patch_px + x is color c, 0 to 255, of pixel (x, y) of the patch; channels beyond those are 0. Without gradient.
at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type);

}  // namespace pictura
