// How far drawn images are from the oracle's, value by value, and whether that is within what kernels may err.
#pragma once

#include "pictura/common/image.h"

namespace pictura {

/// Channel values are in [0, 1].
struct ImageError {
  int64_t values = 0, differing = 0;
  int64_t beyond = 0;  // off by more than kKernelError
  double worst = 0;

  void add(const ImageError& other);
  /// The tolerance of the CUDA renderer (tests/support/tolerances.h).
  bool is_within_tolerance() const;
};

/// Of one view's image of one camera; both of one format and size.
ImageError compare_image(const CameraImages& actual, const CameraImages& expected, PixelFormat format, int view);

}  // namespace pictura
