// Inner loops run over channels, which are adjacent in memory, so that compilers vectorise them.
#include "pictura/policy/host_passes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

namespace {

// Computes exp(x) for x <= 0 with an error of at most 2e-7. exp_of() in common/math.h has equal bits on all devices,
// but multiplies by 2^n in a loop. This function writes 2^n as the exponent bits of a float, which compilers can
// vectorise.
PICTURA_INLINE float exp_of_negative(float x) {
  x = x < -87.0f ? -87.0f : x;  // NaN remains NaN
  // The last bits of the sum are n as an integer; subtracting kRounder again gives n as a float.
  constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23
  const float shifted = x * 1.44269504f + kRounder, n = shifted - kRounder;
  const float r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
  const float p = ((((1.9875691500e-4f * r + 1.3981999507e-3f) * r + 8.3334519073e-3f) * r + 4.1665795894e-2f) * r +
                   1.6666665459e-1f) *
                      r +
                  5.0000001201e-1f;
  const float power = std::bit_cast<float>((std::bit_cast<int32_t>(shifted) + 127) << 23);
  return (p * r * r + r + 1.0f) * power;
}

struct Normal {
  float cumulative, density;  // density: without its factor 1 / sqrt(2 pi)
};

// Returns the standard normal distribution at x. It uses approximation 7.1.26 of the error function in Abramowitz and
// Stegun, because its error is below 1.5e-7 and it computes the exponential that the density also needs.
PICTURA_INLINE Normal normal_at(float x) {
  const float size = x < 0 ? -x : x;
  const float t = 1.0f / (1.0f + 0.3275911f * 0.70710678f * size);
  const float density = exp_of_negative(-0.5f * x * x);
  const float tail = 0.5f * density * t *
                     (0.254829592f + t * (-0.284496736f + t * (1.421413741f + t * (-1.453152027f + t * 1.061405429f))));
  return {x < 0 ? tail : 1.0f - tail, density};
}

constexpr float kDensityFactor = 0.39894228f;

// Several rows with few channels are processed as one row of kRowNumbers numbers, because loops over short rows have a
// large overhead. The last such row may be shorter.
constexpr int64_t kRowNumbers = 64;

int64_t channels_at_once(int64_t channels) {
  return channels < kRowNumbers && kRowNumbers % channels == 0 ? kRowNumbers : channels;
}

PICTURA_INLINE void bias_gelu_of_rows(const float* x, const float* bias, int64_t numbers, int64_t channels, float* out,
                                      float* slope_out) {
  for (int64_t first = 0; first < numbers; first += channels) {
    const int64_t count = std::min(channels, numbers - first);
    const float* const from = x + first;
    float* const to = out + first;
    if (!slope_out) {
#pragma omp simd
      for (int64_t c = 0; c < count; ++c) {
        const float v = from[c] + bias[c];
        to[c] = v * normal_at(v).cumulative;
      }
      continue;
    }
    float* const slope = slope_out + first;
#pragma omp simd
    for (int64_t c = 0; c < count; ++c) {
      const float v = from[c] + bias[c];
      const Normal normal = normal_at(v);
      slope[c] = normal.cumulative + v * kDensityFactor * normal.density;
      to[c] = v * normal.cumulative;
    }
  }
}

PICTURA_INLINE void bias_gelu_backward_of_rows(const float* slope, const float* grad_out, int64_t numbers,
                                               int64_t channels, float* grad_x_out, float* bias_grad_inout) {
  for (int64_t first = 0; first < numbers; first += channels) {
    const int64_t count = std::min(channels, numbers - first);
    const float *const its_slope = slope + first, *const grad = grad_out + first;
    float* const to = grad_x_out + first;
#pragma omp simd
    for (int64_t c = 0; c < count; ++c) {
      const float g = grad[c] * its_slope[c];
      to[c] = g;
      bias_grad_inout[c] += g;
    }
  }
}

PICTURA_WIDE void wide_bias_gelu(const float* x, const float* bias, int64_t numbers, int64_t channels, float* out,
                                 float* slope_out) {
  bias_gelu_of_rows(x, bias, numbers, channels, out, slope_out);
}
PICTURA_WIDE void wide_bias_gelu_backward(const float* slope, const float* grad_out, int64_t numbers, int64_t channels,
                                          float* grad_x_out, float* bias_grad_inout) {
  bias_gelu_backward_of_rows(slope, grad_out, numbers, channels, grad_x_out, bias_grad_inout);
}

}  // namespace

void bias_gelu(const float* x, const float* bias, int64_t rows, int64_t channels, float* out, float* slope_out) {
  const int64_t at_once = channels_at_once(channels);
  float repeated[kRowNumbers];
  if (at_once > channels) {
    for (int64_t c = 0; c < at_once; ++c) repeated[c] = bias[c % channels];
    bias = repeated;
  }
  (has_wide_vectors() ? wide_bias_gelu : bias_gelu_of_rows)(x, bias, rows * channels, at_once, out, slope_out);
}

void bias_gelu_backward(const float* slope, const float* grad_out, int64_t rows, int64_t channels, float* grad_x_out,
                        float* bias_grad_inout) {
  const int64_t at_once = channels_at_once(channels);
  float repeated[kRowNumbers] = {};
  (has_wide_vectors() ? wide_bias_gelu_backward : bias_gelu_backward_of_rows)(
      slope, grad_out, rows * channels, at_once, grad_x_out, at_once > channels ? repeated : bias_grad_inout);
  if (at_once == channels) return;
  for (int64_t c = 0; c < at_once; ++c) bias_grad_inout[c % channels] += repeated[c];
}

void bias_norm(const float* x, const float* bias, int64_t rows, int64_t channels, float* out,
               float* inverse_deviations_out) {
  const auto count = static_cast<float>(channels);
  for (int64_t row = 0; row < rows; ++row) {
    const float* const from = x + row * channels;
    float* const to = out + row * channels;
    float sum = 0, squares = 0;
#pragma omp simd reduction(+ : sum)
    for (int64_t c = 0; c < channels; ++c) {
      to[c] = from[c] + bias[c];
      sum += to[c];
    }
    const float mean = sum / count;
#pragma omp simd reduction(+ : squares)
    for (int64_t c = 0; c < channels; ++c) {
      to[c] -= mean;
      squares += to[c] * to[c];
    }
    const float inverse_deviation = 1.0f / std::sqrt(squares / count + kNormEpsilon);
#pragma omp simd
    for (int64_t c = 0; c < channels; ++c) to[c] *= inverse_deviation;
    if (inverse_deviations_out) inverse_deviations_out[row] = inverse_deviation;
  }
}

void bias_norm_backward(const float* normalized, const float* inverse_deviations, const float* grad_out, int64_t rows,
                        int64_t channels, float* grad_x_out, float* bias_grad_inout) {
  const auto count = static_cast<float>(channels);
  for (int64_t row = 0; row < rows; ++row) {
    const float *const values = normalized + row * channels, *const grad = grad_out + row * channels;
    float* const to = grad_x_out + row * channels;
    float sum = 0, products = 0;
#pragma omp simd reduction(+ : sum, products)
    for (int64_t c = 0; c < channels; ++c) {
      sum += grad[c];
      products += grad[c] * values[c];
    }
    const float mean = sum / count, product_mean = products / count;
#pragma omp simd
    for (int64_t c = 0; c < channels; ++c) {
      const float g = (grad[c] - mean - values[c] * product_mean) * inverse_deviations[row];
      to[c] = g;
      bias_grad_inout[c] += g;
    }
  }
}

namespace {

// Calls f(taps, pixels, count) for each run of `count` consecutive numbers that an output reads from a row of an image.
// `taps` is the run's offset in the taps of all images; `pixels` is its offset in the images, or -1 if the run is
// padding.
template <typename F>
void for_each_run(const ConvolutionSize& size, int64_t n, const F& f) {
  const int64_t channels = size.channels, of_image = size.height * size.width * channels,
                of_tap_row = size.kernel * channels, half = size.kernel / 2;
  int64_t taps = 0;
  for (int64_t image = 0; image < n; ++image) {
    for (int64_t row = 0; row < size.rows(); ++row) {
      for (int64_t column = 0; column < size.columns(); ++column) {
        const int64_t x = column * size.stride - half;
        const int64_t before = std::max<int64_t>(0, -x), end = std::min(size.kernel, size.width - x);
        for (int64_t k = 0; k < size.kernel; ++k, taps += of_tap_row) {
          const int64_t y = row * size.stride - half + k;
          if (y < 0 || y >= size.height) {
            f(taps, int64_t{-1}, of_tap_row);
            continue;
          }
          if (before > 0) f(taps, int64_t{-1}, before * channels);
          f(taps + before * channels, image * of_image + (y * size.width + x + before) * channels,
            (end - before) * channels);
          if (end < size.kernel) f(taps + end * channels, int64_t{-1}, (size.kernel - end) * channels);
        }
      }
    }
  }
}

}  // namespace

void unfold(const ConvolutionSize& size, const float* images, int64_t n, float* taps_out) {
  for_each_run(size, n, [&](int64_t taps, int64_t pixels, int64_t count) {
    if (pixels < 0)
      std::fill_n(taps_out + taps, count, 0.0f);
    else
      for (int64_t i = 0; i < count; ++i) taps_out[taps + i] = images[pixels + i];
  });
}

void fold(const ConvolutionSize& size, const float* taps_grad, int64_t n, float* images_grad_out) {
  std::fill_n(images_grad_out, n * size.height * size.width * size.channels, 0.0f);
  for_each_run(size, n, [&](int64_t taps, int64_t pixels, int64_t count) {
    if (pixels < 0) return;
    for (int64_t i = 0; i < count; ++i) images_grad_out[pixels + i] += taps_grad[taps + i];
  });
}

namespace {

constexpr int64_t kColors = 3;

// Writes the patches of an image. `planes` are the image's three colors. If kPatch > 0, it is the size of patches, so
// that the compiler knows the loop bounds of whole patches; 0: any size.
template <int64_t kPatch>
void patches_of_image(const uint8_t* planes, int64_t height, int64_t width, [[maybe_unused]] int64_t patch_px,
                      float* out) {
  const int64_t patch = kPatch > 0 ? kPatch : patch_px;
  for (int64_t top = 0; top < height; top += patch) {
    for (int64_t left = 0; left < width; left += patch) {
      const bool is_whole = top + patch <= height && left + patch <= width;
      const auto put = [&](int64_t color, int64_t y, int64_t x) {
        *out++ = static_cast<float>(planes[(color * height + top + y) * width + left + x]);
      };
      for (int64_t color = 0; color < kColors; ++color) {
        for (int64_t y = 0; y < patch; ++y) {
          for (int64_t x = 0; x < patch; ++x) {
            if (is_whole || (top + y < height && left + x < width))
              put(color, y, x);
            else
              *out++ = 0;
          }
        }
      }
    }
  }
}

}  // namespace

void patches(const uint8_t* images, int64_t views, int64_t cameras, int64_t camera, int64_t height, int64_t width,
             int64_t patch_px, float* out) {
  const auto of_image = patch_px == 1   ? patches_of_image<1>
                        : patch_px == 2 ? patches_of_image<2>
                        : patch_px == 3 ? patches_of_image<3>
                        : patch_px == 4 ? patches_of_image<4>
                        : patch_px == 6 ? patches_of_image<6>
                                        : patches_of_image<0>;
  const int64_t numbers =
      ((height + patch_px - 1) / patch_px) * ((width + patch_px - 1) / patch_px) * kColors * patch_px * patch_px;
  for (int64_t view = 0; view < views; ++view) {
    of_image(images + (view * cameras + camera) * kColors * height * width, height, width, patch_px,
             out + view * numbers);
  }
}

void member_rows(const float* members, const int32_t* counts, int64_t sets, int64_t max_members, const RowSize& size,
                 float* out) {
  for (int64_t set = 0; set < sets; ++set) {
    for (int32_t member = 0; member < counts[set]; ++member) {
      const float* const row = members + (set * max_members + member) * size.columns;
      out = std::copy_n(row, size.columns, out);
      for (int i = 0; i < size.features.count(); ++i) *out++ = row_feature(size.features, row, i);
    }
  }
}

void largest_members(const float* members, const int32_t* counts, int64_t sets, int64_t channels, float* largest_out,
                     int32_t* which_out) {
  for (int64_t set = 0; set < sets; ++set, largest_out += channels, which_out += channels) {
    const int32_t count = counts[set];
    std::fill_n(largest_out, channels, count > 0 ? -std::numeric_limits<float>::infinity() : 0.0f);
    std::fill_n(which_out, channels, count > 0 ? 0 : -1);
    for (int32_t member = 0; member < count; ++member, members += channels) {
#pragma omp simd
      for (int64_t c = 0; c < channels; ++c) {
        // A NaN counts as the largest value, so that it propagates to the output and is noticed.
        const bool is_larger = (members[c] > largest_out[c]) | (members[c] != members[c]);
        largest_out[c] = is_larger ? members[c] : largest_out[c];
        which_out[c] = is_larger ? member : which_out[c];
      }
    }
  }
}

void largest_members_backward(const float* grad, const int32_t* which, int64_t sets, int64_t channels, int64_t hidden,
                              const float* weight, const float* activations, float* activations_grad_inout,
                              float* weight_grad_inout) {
  // The two gradients are updated one after the other, so that the one in use stays in the first-level cache.
  const auto add_all = [&](const auto& add) {
    for (int64_t i = 0; i < sets * channels; ++i) {
      if (which[i] >= 0) add(grad[i], i % channels, int64_t{which[i]});
    }
  };
  const auto add_row = [hidden](float factor, const float* from, float* to) {
#pragma omp simd
    for (int64_t h = 0; h < hidden; ++h) to[h] += factor * from[h];
  };
  add_all([&](float g, int64_t channel, int64_t row) {
    add_row(g, weight + channel * hidden, activations_grad_inout + row * hidden);
  });
  add_all([&](float g, int64_t channel, int64_t row) {
    add_row(g, activations + row * hidden, weight_grad_inout + channel * hidden);
  });
}

void log_softmax(const float* logits, int64_t rows, int64_t actions, float* out) {
  for (int64_t row = 0; row < rows; ++row, logits += actions, out += actions) {
    const double largest = *std::max_element(logits, logits + actions);
    double sum = 0;
    for (int64_t i = 0; i < actions; ++i) sum += std::exp(logits[i] - largest);
    const double shift = largest + std::log(sum);
    for (int64_t i = 0; i < actions; ++i) out[i] = static_cast<float>(logits[i] - shift);
  }
}

}  // namespace pictura::host
