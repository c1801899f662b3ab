#include "pictura/map/polyline.h"

#include <algorithm>

namespace pictura {

double chord_error(const CurvePoint& a, const CurvePoint& b, const CurvePoint& p) {
  const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z;
  const double length2 = dx * dx + dy * dy + dz * dz;
  double u = 0;
  if (length2 > 0) u = std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy + (p.z - a.z) * dz) / length2, 0.0, 1.0);
  const double ex = p.x - (a.x + u * dx), ey = p.y - (a.y + u * dy), ez = p.z - (a.z + u * dz);
  return std::max(std::sqrt(ex * ex + ey * ey + ez * ez),
                  0.5 * std::abs(p.width - (a.width + u * (b.width - a.width))));
}

std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m) {
  std::vector<std::size_t> indices{0};
  std::size_t first = 0;
  while (first + 1 < points.size()) {
    std::size_t last = first + 1;
    for (std::size_t next = last + 1; next < points.size(); ++next) {
      const CurvePoint &a = points[first], &b = points[next];
      if (std::hypot(b.x - a.x, b.y - a.y) > max_piece_m + kPieceRounding) break;
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
