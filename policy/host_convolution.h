// Convolutions with few output channels on the host, in one thread. They read each output's inputs (taps) in place,
// instead of copying them into a matrix.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// Size of a convolution with channels last, zero-padded by half the kernel.
struct ConvolutionSize {
  int64_t height = 0, width = 0, channels = 0, kernel = 1, stride = 1;
  int64_t rows() const { return (height + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t columns() const { return (width + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t pixels() const { return rows() * columns(); }
  /// Inputs of one output.
  int64_t taps() const { return kernel * kernel * channels; }
  int64_t padded_width() const { return width + 2 * (kernel / 2); }
  /// Values of a padded image.
  int64_t padded_numbers() const { return (height + 2 * (kernel / 2)) * padded_width() * channels; }
};

/// Convolution of contiguous fp32 images. Results do not depend on the vector width.
class DirectConvolution {
 public:
  /// supports() is for compute(), supports_gradient() for compute_image_gradient().
  static bool supports(int64_t outputs) { return outputs == 8 || outputs == 16 || outputs == 32; }
  static bool supports_gradient(int64_t channels) { return channels % 8 == 0; }

  /// max_images: maximum number of images that read() gets.
  DirectConvolution(const ConvolutionSize& size, int64_t outputs, int64_t max_images,
                    bool is_wide = has_wide_vectors());

  /// Copies images [n, height, width, channels] for the functions below.
  void read(const float* images, int64_t n);
  /// Computes outputs. weight: [taps, outputs]; out: [n, rows, columns, outputs].
  void compute(const float* weight, float* out) const;
  /// Adds to the weight's gradient, [taps, outputs]. grad_out: gradient of `out`.
  void add_weight_gradient(const float* grad_out, float* weight_grad_inout) const;

  /// Computes the images' gradient. weight: [outputs, taps].
  void compute_image_gradient(const float* grad_out, const float* weight, float* images_grad_out);

 private:
  /// Calls f(offset in padded_, offset in the images, number of values) for each row.
  template <typename F>
  void for_each_row(const F& f) const;

  ConvolutionSize size_;
  int64_t outputs_, n_ = 0;
  bool is_wide_;
  std::vector<float> padded_, padded_grad_;  // [max_images, height, width, channels] with padding
  std::vector<int64_t> windows_;             // offset of each output's first tap in padded_
};

}  // namespace pictura::host
