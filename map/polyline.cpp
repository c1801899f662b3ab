#include "pictura/map/polyline.h"

#include <algorithm>

namespace pictura {

std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m) {
  std::vector<std::size_t> indices{0};
  std::size_t first = 0;
  while (first + 1 < points.size()) {
    std::size_t last = first + 1;
    // Bounds the time, because each additional point requires a test of all points of the piece.
    constexpr std::size_t kMaxPoints = 1024;
    for (std::size_t next = last + 1; next < std::min(points.size(), first + kMaxPoints); ++next) {
      const CurvePoint &a = points[first], &b = points[next];
      if (!is_within(a.position_m, b.position_m, max_piece_m + kPieceRounding)) break;
      bool close = true;
      for (std::size_t i = first + 1; i < next && close; ++i) close = chord_error(a, b, points[i]) <= tolerance_m;
      if (!close) break;
      last = next;
    }
    indices.push_back(last);
    first = last;
  }
  return indices;
}

}  // namespace pictura
