// Convolutions with few output channels on the host. Convolution by matrix products needs a matrix of each output's
// inputs (taps). Here registers hold the sums of several outputs instead, while taps are read in place.
// Single-threaded, on contiguous fp32 arrays.
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
  /// Whether the convolution supports this number of outputs, and the image gradient this number of channels.
  static bool supports(int64_t outputs) { return outputs == 8 || outputs == 16 || outputs == 32; }
  static bool supports_gradient(int64_t channels) { return channels % 8 == 0; }

  /// Creates a convolution for blocks of at most `max_images` images.
  DirectConvolution(const ConvolutionSize& size, int64_t outputs, int64_t max_images,
                    bool is_wide = has_wide_vectors());

  /// Copies images [n, height, width, channels] for the functions below.
  void read(const float* images, int64_t n);
  /// Computes the outputs. weight: [taps, outputs]; out: [n, rows, columns, outputs].
  void compute(const float* weight, float* out) const;
  /// Adds to the weight gradient, [taps, outputs]. grad_out: gradient of `out`.
  void add_weight_gradient(const float* grad_out, float* weight_grad_inout) const;

  /// Sets the gradient of the images. weight: [outputs, taps].
  void compute_image_gradient(const float* grad_out, const float* weight, float* images_grad_out);

 private:
  /// Calls f(offset of the row in padded_, offset of the row in images, number of values in the row) for each row of
  /// the images.
  template <typename F>
  void for_each_row(const F& f) const;

  ConvolutionSize size_;
  int64_t outputs_, n_ = 0;
  bool is_wide_;
  std::vector<float> padded_, padded_grad_;  // [max_images, height, width, channels] with padding
  std::vector<int64_t> windows_;             // offsets in padded_ at which each output's inputs begin
};

}  // namespace pictura::host
