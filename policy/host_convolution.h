// Convolutions with few output channels on the host. A convolution by matrix products would first copy the inputs of
// each output (its taps) into a matrix. This convolution reads taps in place and keeps the sums of several outputs in
// registers. It runs in one thread on contiguous fp32 arrays.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// Size of a convolution over images with channels last, zero-padded by half the kernel on all sides.
struct ConvolutionSize {
  int64_t height = 0, width = 0, channels = 0, kernel = 1, stride = 1;
  int64_t rows() const { return (height + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t columns() const { return (width + 2 * (kernel / 2) - kernel) / stride + 1; }
  int64_t pixels() const { return rows() * columns(); }
  /// Number of inputs that one output reads.
  int64_t taps() const { return kernel * kernel * channels; }
  int64_t padded_width() const { return width + 2 * (kernel / 2); }
  /// Number of values in a padded image.
  int64_t padded_numbers() const { return (height + 2 * (kernel / 2)) * padded_width() * channels; }
};

/// Convolution of blocks of images. The bits of its results do not depend on the vector width.
class DirectConvolution {
 public:
  /// Whether this number of channels is possible: supports() tests that of compute()'s outputs, supports_gradient()
  /// that of compute_image_gradient()'s images.
  static bool supports(int64_t outputs) { return outputs == 8 || outputs == 16 || outputs == 32; }
  static bool supports_gradient(int64_t channels) { return channels % 8 == 0; }

  /// Creates a convolution for blocks of at most `max_images` images.
  DirectConvolution(const ConvolutionSize& size, int64_t outputs, int64_t max_images,
                    bool is_wide = has_wide_vectors());

  /// Copies images [n, height, width, channels], which the functions below use.
  void read(const float* images, int64_t n);
  /// Computes the outputs of the images. weight: [taps, outputs]; out: [n, rows, columns, outputs].
  void compute(const float* weight, float* out) const;
  /// Adds to the gradient of the weight, [taps, outputs]. grad_out: gradient of `out`.
  void add_weight_gradient(const float* grad_out, float* weight_grad_inout) const;

  /// Computes the gradient of the images. weight: [outputs, taps].
  void compute_image_gradient(const float* grad_out, const float* weight, float* images_grad_out);

 private:
  /// For each row of the images, calls f(offset of the row in padded_, offset in the images, number of values in the
  /// row).
  template <typename F>
  void for_each_row(const F& f) const;

  ConvolutionSize size_;
  int64_t outputs_, n_ = 0;
  bool is_wide_;
  std::vector<float> padded_, padded_grad_;  // [max_images, height, width, channels] with padding
  std::vector<int64_t> windows_;             // for each output, the offset of its first tap in padded_
};

}  // namespace pictura::host
