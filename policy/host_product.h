// Products of matrices on the host, in one thread, on fp32 numbers.
#pragma once

#include <cstdint>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// A matrix that is read: element (r, c) is data[r * row_stride + c * column_stride].
struct ReadMatrix {
  const float* data;
  int64_t row_stride, column_stride = 1;
};

/// out = a b. a: [rows, inner]; b: [inner, columns] without gaps; out: [rows, columns] without gaps, apart from both.
/// Each number is the sum of its products in their order, so the bits of a row depend on no other row and not on the
/// width of vectors.
void multiply(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns, float* out,
              bool is_wide = has_wide_vectors());

}  // namespace pictura::host
