#include "pictura/policy/host_convolution.h"

#include <algorithm>

namespace pictura::host {

namespace {

constexpr int kChannelMultiple = 8;

// Positions of the outputs' inputs (windows) in an array. A window has `kernel` rows of `run` consecutive numbers; its
// rows are row_step numbers apart.
struct Windows {
  const int64_t* begins;  // first element of each window's first row
  int64_t count, kernel, run, row_step;
};

// Computes outputs [window, window + kWindows) of all channels.
template <int kFloats, int kVectors, int kWindows>
PICTURA_INLINE void block_outputs(const Windows& windows, int64_t window, const float* padded, const float* weight,
                                  float* out) {
  using Vector = typename VectorOf<kFloats>::Type;
  constexpr int kOutputs = kFloats * kVectors;
  Vector sums[kWindows][kVectors] = {};
  for (int64_t k = 0; k < windows.kernel; ++k) {
    const float* from[kWindows];
    for (int w = 0; w < kWindows; ++w) from[w] = padded + windows.begins[window + w] + k * windows.row_step;
    for (int64_t t = 0; t < windows.run; ++t, weight += kOutputs) {
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) {
        const Vector factor = vector_at<kFloats>(weight + v * kFloats);
#pragma GCC unroll 8
        for (int w = 0; w < kWindows; ++w) sums[w][v] += factor * from[w][t];
      }
    }
  }
  for (int w = 0; w < kWindows; ++w) {
    for (int v = 0; v < kVectors; ++v) vector_at<kFloats>(out + (window + w) * kOutputs + v * kFloats) = sums[w][v];
  }
}

template <int kFloats, int kVectors, int kWindows>
PICTURA_INLINE void all_outputs(const Windows& windows, const float* padded, const float* weight, float* out) {
  int64_t window = 0;
  for (; window + kWindows <= windows.count; window += kWindows) {
    block_outputs<kFloats, kVectors, kWindows>(windows, window, padded, weight, out);
  }
  for (; window < windows.count; ++window) block_outputs<kFloats, kVectors, 1>(windows, window, padded, weight, out);
}

// Computes weight gradients of taps [tap, tap + kTaps) of row k of the kernel.
template <int kFloats, int kVectors, int kTaps>
PICTURA_INLINE void block_weight_gradients(const Windows& windows, int64_t k, int64_t tap, const float* padded,
                                           const float* grad, float* weight_grad) {
  using Vector = typename VectorOf<kFloats>::Type;
  constexpr int kOutputs = kFloats * kVectors;
  float* const to = weight_grad + (k * windows.run + tap) * kOutputs;
  const float* const from = padded + k * windows.row_step + tap;
  Vector sums[kTaps][kVectors];
  for (int t = 0; t < kTaps; ++t) {
    for (int v = 0; v < kVectors; ++v) sums[t][v] = vector_at<kFloats>(to + t * kOutputs + v * kFloats);
  }
  for (int64_t window = 0; window < windows.count; ++window) {
    const float *const taps = from + windows.begins[window], *const its_grad = grad + window * kOutputs;
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) {
      const Vector factor = vector_at<kFloats>(its_grad + v * kFloats);
#pragma GCC unroll 12
      for (int t = 0; t < kTaps; ++t) sums[t][v] += factor * taps[t];
    }
  }
  for (int t = 0; t < kTaps; ++t) {
    for (int v = 0; v < kVectors; ++v) vector_at<kFloats>(to + t * kOutputs + v * kFloats) = sums[t][v];
  }
}

template <int kFloats, int kVectors, int kTaps>
PICTURA_INLINE void all_weight_gradients(const Windows& windows, const float* padded, const float* grad,
                                         float* weight_grad) {
  for (int64_t k = 0; k < windows.kernel; ++k) {
    int64_t tap = 0;
    for (; tap + kTaps <= windows.run; tap += kTaps) {
      block_weight_gradients<kFloats, kVectors, kTaps>(windows, k, tap, padded, grad, weight_grad);
    }
    for (; tap < windows.run; ++tap) {
      block_weight_gradients<kFloats, kVectors, 1>(windows, k, tap, padded, grad, weight_grad);
    }
  }
}

// Computes gradients of the inputs that windows [window, window + kWindows) read at taps [tap, tap + kVectors *
// kFloats) of row k of the kernel.
template <int kFloats, int kVectors, int kWindows>
PICTURA_INLINE void block_image_gradients(const Windows& windows, int64_t window, int64_t k, int64_t tap,
                                          int64_t outputs, const float* grad, const float* weight, float* padded_grad) {
  using Vector = typename VectorOf<kFloats>::Type;
  const int64_t first = k * windows.run + tap, taps = windows.kernel * windows.run;
  Vector sums[kWindows][kVectors] = {};
  const float* const its_grad = grad + window * outputs;
  for (int64_t o = 0; o < outputs; ++o) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) {
      const Vector factor = vector_at<kFloats>(weight + o * taps + first + v * kFloats);
#pragma GCC unroll 8
      for (int w = 0; w < kWindows; ++w) sums[w][v] += factor * its_grad[w * outputs + o];
    }
  }
  for (int w = 0; w < kWindows; ++w) {
    float* const to = padded_grad + windows.begins[window + w] + k * windows.row_step + tap;
    for (int v = 0; v < kVectors; ++v) vector_at<kFloats>(to + v * kFloats) += sums[w][v];
  }
}

// Computes gradients of all inputs that windows [window, window + kWindows) read.
template <int kFloats, int kWindows>
PICTURA_INLINE void image_gradients_of(const Windows& windows, int64_t window, int64_t outputs, const float* grad,
                                       const float* weight, float* padded_grad) {
  constexpr int kVectors = 3;
  for (int64_t k = 0; k < windows.kernel; ++k) {
    int64_t tap = 0;
    for (; tap + kVectors * kFloats <= windows.run; tap += kVectors * kFloats) {
      block_image_gradients<kFloats, kVectors, kWindows>(windows, window, k, tap, outputs, grad, weight, padded_grad);
    }
    for (; tap < windows.run; tap += kChannelMultiple) {
      block_image_gradients<kChannelMultiple, 1, kWindows>(windows, window, k, tap, outputs, grad, weight, padded_grad);
    }
  }
}

template <int kFloats>
PICTURA_INLINE void all_image_gradients(const Windows& windows, int64_t outputs, const float* grad, const float* weight,
                                        float* padded_grad) {
  // The number of windows per call does not depend on the vector width, so that the order of sums does not depend on it
  // either.
  constexpr int kWindows = 4;
  int64_t window = 0;
  for (; window + kWindows <= windows.count; window += kWindows) {
    image_gradients_of<kFloats, kWindows>(windows, window, outputs, grad, weight, padded_grad);
  }
  for (; window < windows.count; ++window) {
    image_gradients_of<kFloats, 1>(windows, window, outputs, grad, weight, padded_grad);
  }
}

enum class Pass { outputs, weight_gradient, image_gradient };

// Runs one of the three passes. a and b are its inputs: padded images and weight, padded images and gradient, or
// gradient and weight. Uses vectors of 16 floats, or vectors of 8 floats with half as many values in registers.
template <bool kIsWide>
PICTURA_INLINE void run(Pass pass, const Windows& windows, int64_t outputs, const float* a, const float* b,
                        float* out) {
  constexpr int kFloats = kIsWide ? 16 : 8;
  if (pass == Pass::outputs) {
    if (outputs == 8) return all_outputs<8, 1, 8>(windows, a, b, out);
    if (outputs == 16) return all_outputs<kFloats, 16 / kFloats, kIsWide ? 8 : 5>(windows, a, b, out);
    all_outputs<kFloats, 32 / kFloats, kIsWide ? 6 : 3>(windows, a, b, out);
  } else if (pass == Pass::weight_gradient) {
    if (outputs == 8) return all_weight_gradients<8, 1, 9>(windows, a, b, out);
    if (outputs == 16) return all_weight_gradients<kFloats, 16 / kFloats, kIsWide ? 12 : 4>(windows, a, b, out);
    all_weight_gradients<kFloats, 32 / kFloats, kIsWide ? 8 : 3>(windows, a, b, out);
  } else {
    if (windows.run % kFloats == 0) return all_image_gradients<kFloats>(windows, outputs, a, b, out);
    all_image_gradients<kChannelMultiple>(windows, outputs, a, b, out);
  }
}

PICTURA_WIDE void run_wide(Pass pass, const Windows& windows, int64_t outputs, const float* a, const float* b,
                           float* out) {
  run<true>(pass, windows, outputs, a, b, out);
}

// Runs a pass over the first n images.
void run(bool is_wide, Pass pass, const ConvolutionSize& size, const std::vector<int64_t>& begins, int64_t n,
         int64_t outputs, const float* a, const float* b, float* out) {
  const Windows windows{begins.data(), n * size.pixels(), size.kernel, size.kernel * size.channels,
                        size.padded_width() * size.channels};
  (is_wide ? run_wide : run<false>)(pass, windows, outputs, a, b, out);
}

}  // namespace

DirectConvolution::DirectConvolution(const ConvolutionSize& size, int64_t outputs, int64_t max_images, bool is_wide)
    : size_(size),
      outputs_(outputs),
      is_wide_(is_wide),
      padded_(static_cast<size_t>(max_images * size.padded_numbers())) {
  for (int64_t image = 0; image < max_images; ++image) {
    for (int64_t row = 0; row < size.rows(); ++row) {
      for (int64_t column = 0; column < size.columns(); ++column) {
        windows_.push_back(image * size.padded_numbers() +
                           (row * size.padded_width() + column) * size.stride * size.channels);
      }
    }
  }
}

template <typename F>
void DirectConvolution::for_each_row(const F& f) const {
  const int64_t half = size_.kernel / 2, of_row = size_.width * size_.channels,
                of_padded_row = size_.padded_width() * size_.channels;
  for (int64_t image = 0; image < n_; ++image) {
    const int64_t first = image * size_.padded_numbers() + half * of_padded_row + half * size_.channels;
    for (int64_t row = 0; row < size_.height; ++row) {
      f(first + row * of_padded_row, (image * size_.height + row) * of_row, of_row);
    }
  }
}

void DirectConvolution::read(const float* images, int64_t n) {
  n_ = n;
  for_each_row([&](int64_t padded, int64_t offset, int64_t count) {
    std::copy_n(images + offset, count, padded_.data() + padded);
  });
}

void DirectConvolution::compute(const float* weight, float* out) const {
  run(is_wide_, Pass::outputs, size_, windows_, n_, outputs_, padded_.data(), weight, out);
}

void DirectConvolution::add_weight_gradient(const float* grad_out, float* weight_grad_inout) const {
  run(is_wide_, Pass::weight_gradient, size_, windows_, n_, outputs_, padded_.data(), grad_out, weight_grad_inout);
}

void DirectConvolution::compute_image_gradient(const float* grad_out, const float* weight, float* images_grad_out) {
  padded_grad_.assign(static_cast<size_t>(n_ * size_.padded_numbers()), 0.0f);
  run(is_wide_, Pass::image_gradient, size_, windows_, n_, outputs_, grad_out, weight, padded_grad_.data());
  for_each_row([&](int64_t padded, int64_t offset, int64_t count) {
    std::copy_n(padded_grad_.data() + padded, count, images_grad_out + offset);
  });
}

}  // namespace pictura::host
