// Products of fp32 matrices on the host, in one thread.
#pragma once

#include <cstdint>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// Input matrix: element (r, c) is data[r * row_stride + c * column_stride].
struct ReadMatrix {
  const float* data;
  int64_t row_stride, column_stride = 1;
};

/// Computes out = a b. a: [rows, inner]; b: [inner, columns] and out: [rows, columns], both contiguous. `out` must not
/// overlap a or b. Products are summed in a fixed order, so the bits of a row do not depend on other rows or on the
/// width of vectors.
void multiply(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns, float* out,
              bool is_wide = has_wide_vectors());

}  // namespace pictura::host
