// Matrix products. They read both matrices in place and keep the sums of a few rows and columns in registers.
#include "pictura/policy/host_product.h"

namespace pictura::host {

namespace {

// Computes rows [0, kRows) and columns [0, kVectors * kFloats) of the product.
template <int kFloats, int kVectors, int kRows>
PICTURA_INLINE void some_sums(const ReadMatrix& a, const float* b, int64_t inner, int64_t columns, float* out) {
  using Vector = typename VectorOf<kFloats>::Type;
  Vector sums[kRows][kVectors] = {};
  for (int64_t i = 0; i < inner; ++i) {
    const float* const factors = a.data + i * a.column_stride;
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) {
      const Vector from = vector_at<kFloats>(b + i * columns + v * kFloats);
#pragma GCC unroll 8
      for (int r = 0; r < kRows; ++r) sums[r][v] += from * factors[r * a.row_stride];
    }
  }
  for (int r = 0; r < kRows; ++r) {
    for (int v = 0; v < kVectors; ++v) vector_at<kFloats>(out + r * columns + v * kFloats) = sums[r][v];
  }
}

// Computes columns [0, kVectors * kFloats) of all rows.
template <int kFloats, int kVectors>
PICTURA_INLINE void all_rows(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns,
                             float* out) {
  constexpr int kRows = 6;
  int64_t row = 0;
  const auto rest = [&] { return ReadMatrix{a.data + row * a.row_stride, a.row_stride, a.column_stride}; };
  for (; row + kRows <= rows; row += kRows) {
    some_sums<kFloats, kVectors, kRows>(rest(), b, inner, columns, out + row * columns);
  }
  for (; row < rows; ++row) some_sums<kFloats, kVectors, 1>(rest(), b, inner, columns, out + row * columns);
}

template <int kFloats>
PICTURA_INLINE void all_columns(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns,
                                float* out) {
  int64_t column = 0;
  for (; column + 2 * kFloats <= columns; column += 2 * kFloats) {
    all_rows<kFloats, 2>(a, b + column, rows, inner, columns, out + column);
  }
  for (; column + 4 <= columns; column += 4) all_rows<4, 1>(a, b + column, rows, inner, columns, out + column);
  for (; column < columns; ++column) all_rows<1, 1>(a, b + column, rows, inner, columns, out + column);
}

PICTURA_WIDE void wide_multiply(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns,
                                float* out) {
  all_columns<16>(a, b, rows, inner, columns, out);
}

}  // namespace

void multiply(const ReadMatrix& a, const float* b, int64_t rows, int64_t inner, int64_t columns, float* out,
              bool is_wide) {
  (is_wide ? wide_multiply : all_columns<8>)(a, b, rows, inner, columns, out);
}

}  // namespace pictura::host
