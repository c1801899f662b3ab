#include "pictura/map/polyline.h"

#include <algorithm>

namespace pictura {

double chord_error(const CurvePoint& a, const CurvePoint& b, const CurvePoint& p) {
  // Sums in plan first: maps keep their bits.
  const auto dot = [](const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
    return v.head<2>().dot(w.head<2>()) + v.z() * w.z();
  };
  const Eigen::Vector3d chord = b.position_m - a.position_m;
  const double length2 = dot(chord, chord);
  double u = 0;
  if (length2 > 0) u = std::clamp(dot(p.position_m - a.position_m, chord) / length2, 0.0, 1.0);
  const Eigen::Vector3d error = p.position_m - (a.position_m + u * chord);
  return std::max(std::sqrt(dot(error, error)), 0.5 * std::abs(p.width - (a.width + u * (b.width - a.width))));
}

std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m) {
  std::vector<std::size_t> indices{0};
  std::size_t first = 0;
  while (first + 1 < points.size()) {
    std::size_t last = first + 1;
    for (std::size_t next = last + 1; next < points.size(); ++next) {
      const CurvePoint &a = points[first], &b = points[next];
      if (plan_distance_m(a.position_m, b.position_m) > max_piece_m + kPieceRounding) break;
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
