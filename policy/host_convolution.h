// Convolutions of few outputs on the host, without the matrices of taps that products of matrices need: registers hold
// the sums of several outputs while taps are read where they lie. In one thread, on fp32 numbers without gaps.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// A convolution over images whose pixels have their channels together, padded by zeros by half the kernel on all
/// sides.
struct ConvolutionSize {
  int64_t height = 0, width = 0, channels = 0, kernel = 1, stride = 1;
  int64_t rows() const { return (height + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t columns() const { return (width + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t pixels() const { return rows() * columns(); }
  /// Of the input that an output reads.
  int64_t taps() const { return kernel * kernel * channels; }
  int64_t padded_width() const { return width + 2 * (kernel / 2); }
  /// Numbers of an image with its padding.
  int64_t padded_numbers() const { return (height + 2 * (kernel / 2)) * padded_width() * channels; }
};

/// A convolution of blocks of images. Its bits do not depend on the width of vectors.
class DirectConvolution {
 public:
  /// Whether there is code for so many outputs, and for the gradient of images of so many channels.
  static bool takes(int64_t outputs) { return outputs == 8 || outputs == 16 || outputs == 32; }
  static bool takes_gradient(int64_t channels) { return channels % 8 == 0; }

  /// For blocks of at most `most` images.
  DirectConvolution(const ConvolutionSize& size, int64_t outputs, int64_t most, bool is_wide = has_wide_vectors());

  /// Copies images [n, height, width, channels] for the functions that follow.
  void read(const float* images, int64_t n);
  /// weight: [taps, outputs]; out: [n, rows, columns, outputs].
  void compute(const float* weight, float* out) const;
  /// Adds to the gradient of the weight, [taps, outputs]. grad_out: that of `out`.
  void add_weight_gradient(const float* grad_out, float* weight_grad_inout) const;

  /// Sets the gradient of the images. weight: [outputs, taps].
  void compute_image_gradient(const float* grad_out, const float* weight, float* images_grad_out);

 private:
  /// Calls f(offset of the row in padded_, its offset in images, its numbers) for each row of the images.
  template <typename F>
  void for_each_row(const F& f) const;

  ConvolutionSize size_;
  int64_t outputs_, n_ = 0;
  bool is_wide_;
  std::vector<float> padded_, padded_grad_;  // [most, height, width, channels] with padding
  std::vector<int64_t> windows_;             // where in padded_ that begins which an output reads
};

}  // namespace pictura::host
