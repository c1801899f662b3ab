// Operations of a network on the host besides matrix products. Each operation loops over contiguous fp32 rows and
// passes once over memory, while ATen passes several times. Every function runs in one thread. Callers distribute rows
// among threads, in blocks that fit a core's cache.
#pragma once

#include <cstdint>

#include "pictura/policy/host_convolution.h"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::host {

/// Maximum number of activations in a block. A block of this size and its results fit a core's second-level cache (at
/// least 0.5 MB on current processors).
constexpr int64_t kBlockNumbers = 48 * 1024;

/// Computes out = GELU(x + bias), with the exact (error function) GELU. The error is at most 2e-7 max(1, |x + bias|).
/// Also computes the derivative if slope_out is not null. x, out, slope_out: [rows, channels]; out or slope_out may be
/// x. bias: [channels].
void bias_gelu(const float* x, const float* bias, int64_t rows, int64_t channels, float* out, float* slope_out);

/// Backward pass of bias_gelu(). Computes the gradient of x as slope * grad_out, and adds the gradient of the bias to
/// bias_grad_inout, [channels]. grad_x_out may be grad_out.
void bias_gelu_backward(const float* slope, const float* grad_out, int64_t rows, int64_t channels, float* grad_x_out,
                        float* bias_grad_inout);

/// Computes out = layer norm of (x + bias) over channels, without parameters, with an epsilon of 1e-5. Also computes
/// the reciprocal of each row's standard deviation, [rows], if inverse_deviations_out is not null. x, out: [rows,
/// channels]; out may be x. bias: [channels].
void bias_norm(const float* x, const float* bias, int64_t rows, int64_t channels, float* out,
               float* inverse_deviations_out);

/// Backward pass of bias_norm(), whose output is `normalized`. Computes the gradient of x, and adds the gradient of the
/// bias to bias_grad_inout, [channels]. grad_x_out may be grad_out.
void bias_norm_backward(const float* normalized, const float* inverse_deviations, const float* grad_out, int64_t rows,
                        int64_t channels, float* grad_x_out, float* bias_grad_inout);

/// Copies the inputs (taps) of each output of the convolution, so that the convolution becomes a matrix product.
/// images: [n, height, width, channels]; taps_out: [n, rows, columns, kernel, kernel, channels].
void unfold(const ConvolutionSize& size, const float* images, int64_t n, float* taps_out);
/// Backward pass of unfold(): computes the gradient of the images from the gradient of the taps.
void fold(const ConvolutionSize& size, const float* taps_grad, int64_t n, float* images_grad_out);

/// Splits the images of one camera into patches of patch_px^2 pixels. images: u8 [views, cameras, 3, height, width];
/// out: [views, rows, columns, 3 patch_px^2]. Channel (c * patch_px + y) * patch_px + x is the value (0 to 255) of
/// color c of pixel (x, y) of the patch; pixels beyond the image are 0. rows, columns: height and width over patch_px,
/// rounded up.
void patches(const uint8_t* images, int64_t views, int64_t cameras, int64_t camera, int64_t height, int64_t width,
             int64_t patch_px, float* out);

/// Writes the members of all entity sets consecutively, each member followed by its features; padding is omitted.
/// members: [sets, max_members, size.columns]; counts: [sets], at most `max_members`. size.keeps_rows must be true;
/// size.rows is ignored. out: [sum of counts, size.width()].
void member_rows(const float* members, const int32_t* counts, int64_t sets, int64_t max_members, const RowSize& size,
                 float* out);

/// Finds the largest value of each channel among the members of each set, and the index of the first member with this
/// value. For an empty set, the value is 0 and the index is -1. members: [sum of counts, channels], set after set.
void largest_members(const float* members, const int32_t* counts, int64_t sets, int64_t channels, float* largest_out,
                     int32_t* which_out);

/// Backward pass of largest_members() and of the linear layer before it, which computes `members` from `activations`.
/// The gradient of each channel goes only to the largest member. grad: [sets, channels]; which: [sets, channels], the
/// row of this member in `activations`, or -1 for an empty set; weight: [channels, hidden]; activations: [rows,
/// hidden]. Adds the gradients to activations_grad_inout, [rows, hidden], and weight_grad_inout, [channels, hidden].
void largest_members_backward(const float* grad, const int32_t* which, int64_t sets, int64_t channels, int64_t hidden,
                              const float* weight, const float* activations, float* activations_grad_inout,
                              float* weight_grad_inout);

/// Computes log-probabilities of actions from their logits, [rows, actions]; `out` may be `logits`.
void log_softmax(const float* logits, int64_t rows, int64_t actions, float* out);

}  // namespace pictura::host
