#include "pictura/map/surface.h"

#include <cmath>

namespace pictura {

namespace {

constexpr float kCell_m = 4.0f;
// Budget of quad tests of a surface: a constant, plus an amount per quad.
constexpr int64_t kBaseLookups = 10'000'000, kLookupsPerQuad = 5000;  // CARLA's towns need up to 544 per quad

double cross_product(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector2d& p) {
  const Eigen::Vector2d side = (b - a).head<2>(), to_p = p - a.head<2>();
  return side.x() * to_p.y() - side.y() * to_p.x();
}

bool in_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                 const Eigen::Vector2d& p) {
  const double ab = cross_product(a, b, p), bc = cross_product(b, c, p), ca = cross_product(c, a, p);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

}  // namespace

Surface::Surface(const std::vector<SurfaceBand>& bands, double level_m) : level_m_(level_m) {
  std::vector<Aabb2> boxes;
  for (std::size_t band = 0; band < bands.size(); ++band) {
    const auto& [left, right] = bands[band];
    for (std::size_t i = 0; i + 1 < left.size(); ++i) {
      const Quad quad{{left[i], right[i], right[i + 1], left[i + 1]}, static_cast<int32_t>(band)};
      Aabb2 box{{1e30f, 1e30f}, {-1e30f, -1e30f}};
      for (const Eigen::Vector3d& corner : quad.corners) {
        const float x = static_cast<float>(corner.x()), y = static_cast<float>(corner.y());
        box.low = {min_of(box.low.x, x), min_of(box.low.y, y)};
        box.high = {max_of(box.high.x, x), max_of(box.high.y, y)};
      }
      quads_.push_back(quad);
      boxes.push_back(box);
    }
  }
  grid_ = Grid(boxes, kCell_m);
  remaining_lookups_ = kBaseLookups + kLookupsPerQuad * static_cast<int64_t>(quads_.size());
}

/// Two triangles, so that non-convex quads are covered as drawn.
bool Surface::contains(const Quad& quad, const Eigen::Vector2d& p, double z) const {
  const Eigen::Vector3d* c = quad.corners;
  const double mean_z = 0.25 * (c[0].z() + c[1].z() + c[2].z() + c[3].z());
  if (std::abs(z - mean_z) >= level_m_) return false;
  return in_triangle(c[0], c[1], c[2], p) || in_triangle(c[0], c[2], c[3], p);
}

}  // namespace pictura
