// What a network on the host does to its activations between matrix products: loops over fp32 rows without gaps, in
// one pass where ATen takes several. All work in one thread on what they are given, so that callers divide rows among
// threads and choose blocks that stay in a core's cache.
#pragma once

#include <cstdint>

#include "pictura/policy/host_convolution.h"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::host {

/// How many numbers a block of activations may have so that it stays in a core's second-level cache (0.5 MB and more
/// on today's processors), beside what is made of it.
constexpr int64_t kBlockNumbers = 48 * 1024;

/// out = GELU(x + bias), by the error function, within 2e-7 of max(1, |x + bias|); and its derivative there, where
/// slope_out is not null. x, out, slope_out: [rows, channels]; either may be x. bias: [channels].
void bias_gelu(const float* x, const float* bias, int64_t rows, int64_t channels, float* out, float* slope_out);

/// The gradient of x, slope * grad_out, and that of the bias added to bias_grad_inout, [channels]. grad_x_out may be
/// grad_out.
void bias_gelu_backward(const float* slope, const float* grad_out, int64_t rows, int64_t channels, float* grad_x_out,
                        float* bias_grad_inout);

/// out = the layer norm, without parameters, of x + bias over channels, with an epsilon of 1e-5; and 1 over the
/// deviation of each row, [rows], where inverse_deviations_out is not null. x, out: [rows, channels]; either may be x.
/// bias: [channels].
void bias_norm(const float* x, const float* bias, int64_t rows, int64_t channels, float* out,
               float* inverse_deviations_out);

/// The gradient of x from that of what bias_norm() made of it, `normalized`; and that of the bias added to
/// bias_grad_inout, [channels]. grad_x_out may be grad_out.
void bias_norm_backward(const float* normalized, const float* inverse_deviations, const float* grad_out, int64_t rows,
                        int64_t channels, float* grad_x_out, float* bias_grad_inout);

/// What each output of the convolution reads, so that it becomes a matrix product. images: [n, height, width,
/// channels]; taps_out: [n, rows, columns, kernel, kernel, channels].
void unfold(const ConvolutionSize& size, const float* images, int64_t n, float* taps_out);
/// The gradient of the images from that of what was read.
void fold(const ConvolutionSize& size, const float* taps_grad, int64_t n, float* images_grad_out);

/// u8 images [views, cameras, 3, height, width] as patches of patch_px^2 pixels, patch_px at most 4: [views, rows,
/// columns, 3 patch_px^2] of one camera; channel (c * patch_px + y) * patch_px + x is color c, 0 to 255, of pixel (x,
/// y) of the patch, beyond the image 0. rows, columns: height and width over patch_px, rounded up.
void patches(const uint8_t* images, int64_t views, int64_t cameras, int64_t camera, int64_t height, int64_t width,
             int64_t patch_px, float* out);

/// The members that there are of sets, those of one set after those of the one before, each followed by its
/// features. members: [sets, most, size.columns]; counts: [sets], at most `most`; size.keeps_rows must be set, its rows
/// are not read. out: [sum of counts, size.width()].
void member_rows(const float* members, const int32_t* counts, int64_t sets, int64_t most, const RowSize& size,
                 float* out);

/// Of each set the largest of its members in each channel, and which member that is, the first of equal ones; 0 and -1
/// in an empty set. members: [sum of counts, channels], those of one set after those of the one before.
void largest_members(const float* members, const int32_t* counts, int64_t sets, int64_t channels, float* largest_out,
                     int32_t* which_out);

/// The way back from the largest embeddings of sets through their linear layer, where each channel's gradient goes to
/// one member alone. grad: [sets, channels]; which: i32 [sets, channels], the row of the member among `activations`,
/// [rows, hidden], -1 in an empty set; weight: [channels, hidden]. activations_grad_inout, [rows, hidden], and
/// weight_grad_inout, [channels, hidden], are added to.
void largest_members_backward(const float* grad, const int32_t* which, int64_t sets, int64_t channels, int64_t hidden,
                              const float* weight, const float* activations, float* activations_grad_inout,
                              float* weight_grad_inout);

}  // namespace pictura::host
