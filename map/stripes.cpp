#include "pictura/map/stripes.h"

#include <algorithm>
#include <cmath>

namespace pictura {

std::vector<CurvePoint> moved_left(const std::vector<CurvePoint>& line, double offset_m) {
  std::vector<CurvePoint> moved = line;
  const auto normal_of = [&](std::size_t i) {
    const Eigen::Vector2d way = (line[i + 1].position_m - line[i].position_m).head<2>();
    return Eigen::Vector2d(-way.y(), way.x()).normalized().eval();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    Eigen::Vector2d normal = normal_of(std::min(i, line.size() - 2));
    if (i > 0 && i + 1 < line.size()) {
      const Eigen::Vector2d sum = normal + normal_of(i - 1);
      normal = sum.norm() > 1e-9 ? (2 * sum / std::max(sum.squaredNorm(), 1.0)).eval() : normal;
    }
    moved[i].position_m.head<2>() += offset_m * normal;
  }
  return moved;
}

std::vector<CurvePoint> part_of(const std::vector<CurvePoint>& line, double begin_m, double end_m) {
  std::vector<CurvePoint> part;
  double s_m = 0;
  for (std::size_t i = 0; i + 1 < line.size() && s_m < end_m; ++i) {
    const double way_m = plan_distance_m(line[i].position_m, line[i + 1].position_m);
    const auto at = [&](double s) {
      return CurvePoint{0, line[i].position_m + (s - s_m) / way_m * (line[i + 1].position_m - line[i].position_m), 0};
    };
    if (s_m + way_m > begin_m) {
      if (part.empty()) part.push_back(at(std::max(begin_m, s_m)));
      part.push_back(at(std::min(end_m, s_m + way_m)));
    }
    s_m += way_m;
  }
  return part;
}

double plan_length_m(const std::vector<CurvePoint>& line) {
  double length_m = 0;
  for (std::size_t i = 1; i < line.size(); ++i) {
    length_m += plan_distance_m(line[i - 1].position_m, line[i].position_m);
  }
  return length_m;
}

std::vector<std::vector<CurvePoint>> dashes_of(const std::vector<CurvePoint>& line) {
  const double length_m = plan_length_m(line);
  const int count = std::max(1, static_cast<int>(std::floor((length_m + kDashPeriod_m - kDash_m) / kDashPeriod_m)));
  const double begin_m = std::max(0.0, 0.5 * (length_m - ((count - 1) * kDashPeriod_m + kDash_m)));
  std::vector<std::vector<CurvePoint>> dashes;
  for (int i = 0; i < count; ++i) {
    const double at_m = begin_m + i * kDashPeriod_m;
    dashes.push_back(part_of(line, at_m, std::min(length_m, at_m + kDash_m)));
  }
  return dashes;
}

}  // namespace pictura
