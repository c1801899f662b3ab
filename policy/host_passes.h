// Operations of a network on the host between matrix products: loops over contiguous fp32 rows, in one pass over memory
// where ATen takes several. Every function runs in one thread on the rows that it is given. Callers divide rows among
// threads and choose blocks that stay in a core's cache.
#pragma once

#include <cstdint>

#include "pictura/policy/host_convolution.h"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::host {

/// Maximum number of activations in a block, at which the block and its results stay in a core's second-level cache
/// (0.5 MB and more on current processors).
constexpr int64_t kBlockNumbers = 48 * 1024;

/// Computes out = GELU(x + bias), by the error function, with an error of at most 2e-7 max(1, |x + bias|). Also
/// computes the derivative if slope_out is not null. x, out, slope_out: [rows, channels]; out or slope_out may be x.
/// bias: [channels].
void bias_gelu(const float* x, const float* bias, int64_t rows, int64_t channels, float* out, float* slope_out);

/// Computes the gradient of x, slope * grad_out, and adds the bias gradient to bias_grad_inout, [channels]. grad_x_out
/// may be grad_out.
void bias_gelu_backward(const float* slope, const float* grad_out, int64_t rows, int64_t channels, float* grad_x_out,
                        float* bias_grad_inout);

/// Computes out = layer norm, without parameters, of x + bias over channels, with an epsilon of 1e-5. Also computes 1
/// over the standard deviation of each row, [rows], if inverse_deviations_out is not null. x, out: [rows, channels];
/// out may be x. bias: [channels].
void bias_norm(const float* x, const float* bias, int64_t rows, int64_t channels, float* out,
               float* inverse_deviations_out);

/// Computes the gradient of x from the gradient of `normalized`, the output of bias_norm(), and adds the bias gradient
/// to bias_grad_inout, [channels]. grad_x_out may be grad_out.
void bias_norm_backward(const float* normalized, const float* inverse_deviations, const float* grad_out, int64_t rows,
                        int64_t channels, float* grad_x_out, float* bias_grad_inout);

/// Gathers the inputs of each output of the convolution, so that the convolution becomes a matrix product. images: [n,
/// height, width, channels]; taps_out: [n, rows, columns, kernel, kernel, channels].
void unfold(const ConvolutionSize& size, const float* images, int64_t n, float* taps_out);
/// Computes the gradient of the images from the gradient of the taps that unfold() gathers.
void fold(const ConvolutionSize& size, const float* taps_grad, int64_t n, float* images_grad_out);

/// Splits u8 images [views, cameras, 3, height, width] of one camera into patches of patch_px^2 pixels:
/// [views, rows, columns, 3 patch_px^2]. Channel (c * patch_px + y) * patch_px + x is color c, 0 to 255, of
/// pixel (x, y) of the patch; pixels beyond the image are 0. rows, columns: height and width over patch_px, rounded up.
void patches(const uint8_t* images, int64_t views, int64_t cameras, int64_t camera, int64_t height, int64_t width,
             int64_t patch_px, float* out);

/// Writes the present members of all sets consecutively, each member followed by its features. members: [sets,
/// max_members, size.columns]; counts: [sets], at most `max_members`. size.keeps_rows must be set; size.rows is not
/// read. out: [sum of counts, size.width()].
void member_rows(const float* members, const int32_t* counts, int64_t sets, int64_t max_members, const RowSize& size,
                 float* out);

/// Finds the largest value of each channel among the members of each set, and the index in the set of the first member
/// with that value. In an empty set the value is 0 and the index -1. members: [sum of counts, channels], set after set.
void largest_members(const float* members, const int32_t* counts, int64_t sets, int64_t channels, float* largest_out,
                     int32_t* which_out);

/// Backward pass from the largest embeddings of sets through the linear layer that computes embeddings. The gradient of
/// each channel goes to only one member. grad: [sets, channels]; which: i32 [sets, channels], row of that member in
/// `activations`, [rows, hidden], or -1 in an empty set; weight: [channels, hidden]. Adds to activations_grad_inout,
/// [rows, hidden], and weight_grad_inout, [channels, hidden].
void largest_members_backward(const float* grad, const int32_t* which, int64_t sets, int64_t channels, int64_t hidden,
                              const float* weight, const float* activations, float* activations_grad_inout,
                              float* weight_grad_inout);

/// Computes log-probabilities of actions from their logits, [rows, actions]; `out` may be `logits`.
void log_softmax(const float* logits, int64_t rows, int64_t actions, float* out);

}  // namespace pictura::host
