// Operations of a network on the host besides matrix products. Each passes once over contiguous fp32 rows, in one
// thread. Callers distribute blocks of rows among threads.
#pragma once

#include <cstdint>

#include "pictura/policy/host_convolution.h"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::host {

/// Maximum number of activations in a block that fits, together with its results, into a core's second-level cache.
constexpr int64_t kBlockNumbers = 48 * 1024;

/// Computes out = GELU(x + bias) with the error function; the error is at most 2e-7 max(1, |x + bias|). slope_out gets
/// the derivative, unless null. x, out, slope_out: [rows, channels]; out or slope_out may be x. bias: [channels].
void bias_gelu(const float* x, const float* bias, int64_t rows, int64_t channels, float* out, float* slope_out);

/// Computes the gradient of x (slope * grad_out), and adds the bias's gradient. grad_x_out may be grad_out.
void bias_gelu_backward(const float* slope, const float* grad_out, int64_t rows, int64_t channels, float* grad_x_out,
                        float* bias_grad_inout);

/// Computes out = layer norm of (x + bias) over channels, without parameters, with kNormEpsilon.
/// inverse_deviations_out gets 1 / (standard deviation) of each row, unless null. x, out: [rows, channels]; out may be
/// x.
void bias_norm(const float* x, const float* bias, int64_t rows, int64_t channels, float* out,
               float* inverse_deviations_out);

/// Computes the gradient of x from bias_norm()'s output `normalized`, and adds the bias's gradient. grad_x_out may be
/// grad_out.
void bias_norm_backward(const float* normalized, const float* inverse_deviations, const float* grad_out, int64_t rows,
                        int64_t channels, float* grad_x_out, float* bias_grad_inout);

/// Copies each output's inputs (taps), so that a convolution becomes a matrix product. images: [n, height, width,
/// channels]; taps_out: [n, rows, columns, kernel, kernel, channels].
void unfold(const ConvolutionSize& size, const float* images, int64_t n, float* taps_out);
/// Backward pass of unfold().
void fold(const ConvolutionSize& size, const float* taps_grad, int64_t n, float* images_grad_out);

/// Splits one camera's images into patches. Channels are ordered as in PatchSize, but end after 3 patch_px^2. images:
/// u8 [views, cameras, 3, height, width]; out: [views, rows, columns, 3 patch_px^2].
void patches(const uint8_t* images, int64_t views, int64_t cameras, int64_t camera, int64_t height, int64_t width,
             int64_t patch_px, float* out);

/// Writes the members of all sets and their features consecutively, without padding. members: [sets, max_members,
/// size.columns]; counts: [sets]; out: [sum of counts, size.width()]. size.keeps_rows must be true; size.rows is
/// ignored.
void member_rows(const float* members, const int32_t* counts, int64_t sets, int64_t max_members, const RowSize& size,
                 float* out);

/// Finds each channel's largest value in each set (0 if empty), and the index of the first member with it (-1 if
/// empty). members: [sum of counts, channels].
void largest_members(const float* members, const int32_t* counts, int64_t sets, int64_t channels, float* largest_out,
                     int32_t* which_out);

/// Backward pass of largest_members() and of the linear layer before it, which maps `activations` to `members`. Adds to
/// the gradients of activations and weight. grad: [sets, channels]; which: [sets, channels], the largest member's row
/// in `activations`, or -1; weight: [channels, hidden]; activations: [rows, hidden].
void largest_members_backward(const float* grad, const int32_t* which, int64_t sets, int64_t channels, int64_t hidden,
                              const float* weight, const float* activations, float* activations_grad_inout,
                              float* weight_grad_inout);

/// Computes log-probabilities of logits [rows, actions]; `out` may be `logits`.
void log_softmax(const float* logits, int64_t rows, int64_t actions, float* out);

}  // namespace pictura::host
