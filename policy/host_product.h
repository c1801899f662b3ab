// Products of fp32 matrices on the host, in one thread.
#pragma once

#include <cstdint>

#include "pictura/policy/wide_vectors.h"

namespace pictura::host {

/// Matrix with element (r, c) at data[r * row_stride + c * column_stride].
struct ReadMatrix {
  const float* data;
  int64_t row_stride, column_stride = 1;
};

/// Computes out = a b. b: [inner, columns] and out: [rows, columns] are contiguous; `out` overlaps neither a nor b. The
/// order of sums is fixed: a row's bits do not depend on other rows or on the vector width.
void multiply(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns, float* out,
              bool is_wide = has_wide_vectors());

}  // namespace pictura::host
