#include "pictura/map/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pictura {

namespace {

constexpr float kQuadCell_m = 4.0f;
// Maximum number of quad tests of a surface: a constant plus a number per quad.
constexpr int64_t kBaseLookups = 10'000'000, kLookupsPerQuad = 5000;  // CARLA's towns need up to 544 per quad

double cross_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const Eigen::Vector2d side = b - a, to_p = p - a;
  return side.x() * to_p.y() - side.y() * to_p.x();
}

bool in_triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                 const Eigen::Vector2d& p) {
  const double ab = cross_product(a, b, p), bc = cross_product(b, c, p), ca = cross_product(c, a, p);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

}  // namespace

Surface::Surface(const std::vector<SurfaceBand>& bands, double level_m) : level_m_(level_m) {
  std::size_t num_quads = 0;
  for (const SurfaceBand& band : bands) num_quads += std::max<std::size_t>(band.left.size(), 1) - 1;
  std::vector<Aabb2> boxes;
  boxes.reserve(num_quads);
  quads_.reserve(num_quads);
  for (std::size_t band = 0; band < bands.size(); ++band) {
    const auto& [left, right] = bands[band];
    first_quads_.push_back(quads_.size());
    double s_m = 0;
    for (std::size_t i = 0; i + 1 < left.size(); ++i) {
      const Eigen::Vector3d* corners[4] = {&left[i], &right[i], &right[i + 1], &left[i + 1]};
      Quad quad{.band = static_cast<int32_t>(band)};
      for (std::size_t k = 0; k < 4; ++k) quad.corners_m[k] = corners[k]->head<2>();
      const double length_m = std::max(plan_distance_m(left[i], left[i + 1]), plan_distance_m(right[i], right[i + 1]));
      quad.s_m = s_m + 0.5 * length_m;
      s_m += length_m;
      quad.mean_z_m = 0.25 * (corners[0]->z() + corners[1]->z() + corners[2]->z() + corners[3]->z());
      Aabb2 box{{1e30f, 1e30f}, {-1e30f, -1e30f}};
      for (const Eigen::Vector2d& corner : quad.corners_m) {
        const float x = static_cast<float>(corner.x()), y = static_cast<float>(corner.y());
        box.low = {min_of(box.low.x, x), min_of(box.low.y, y)};
        box.high = {max_of(box.high.x, x), max_of(box.high.y, y)};
      }
      quads_.push_back(quad);
      boxes.push_back(box);
    }
  }
  grid_ = Grid(boxes, kQuadCell_m);
  const GridView grid = grid_.view();
  bounds_.reserve(grid.items.size() + ItemBounds::kPadding);
  for (const int32_t quad : grid.items) bounds_.push_back(bounds_of(quads_[quad]));
  for (std::size_t i = 0; i < ItemBounds::kPadding; ++i) bounds_.push_back({});
  remaining_lookups_ = kBaseLookups + kLookupsPerQuad * static_cast<int64_t>(quads_.size());
}

void Surface::ItemBounds::reserve(std::size_t count) {
  for (std::vector<float>* side : {&low_x, &high_x, &low_y, &high_y, &low_z, &high_z}) side->reserve(count);
}

void Surface::ItemBounds::push_back(const QuadBounds& bounds) {
  low_x.push_back(bounds.low.x);
  high_x.push_back(bounds.high.x);
  low_y.push_back(bounds.low.y);
  high_y.push_back(bounds.high.y);
  low_z.push_back(bounds.low_z);
  high_z.push_back(bounds.high_z);
}

/// Returns the bounds of a quad. For a triangle of almost no area, the test depends on rounding, and may accept points
/// far away along the triangle's line. So quads with such triangles are bounded only in height.
Surface::QuadBounds Surface::bounds_of(const Quad& quad) const {
  constexpr float kMargin_m =
      static_cast<float>(kNear_m) + 0.05f;  // far more than the rounding of coordinates to float
  constexpr double kMinArea_m2 = 0.01;
  const Eigen::Vector2d* c = quad.corners_m;
  QuadBounds bounds{{-1e30f, -1e30f}, {1e30f, 1e30f}};
  bounds.low_z = static_cast<float>(quad.mean_z_m - level_m_) - kMargin_m;
  bounds.high_z = static_cast<float>(quad.mean_z_m + level_m_) + kMargin_m;
  const double area = std::min(std::abs(cross_product(c[0], c[1], c[2])), std::abs(cross_product(c[0], c[2], c[3])));
  if (!(area >= 2 * kMinArea_m2)) return bounds;
  std::swap(bounds.low, bounds.high);
  for (int i = 0; i < 4; ++i) {
    const float x = static_cast<float>(c[i].x()), y = static_cast<float>(c[i].y());
    bounds.low = {min_of(bounds.low.x, x - kMargin_m), min_of(bounds.low.y, y - kMargin_m)};
    bounds.high = {max_of(bounds.high.x, x + kMargin_m), max_of(bounds.high.y, y + kMargin_m)};
  }
  return bounds;
}

void Surface::find_near(const Eigen::Vector2d& p, double z, Candidates* out) const {
  out->quads.clear();
  const GridView grid = grid_.view();
  const float margin = static_cast<float>(kNear_m) + 0.01f;
  const Vec2 position{static_cast<float>(p.x()), static_cast<float>(p.y())};
  const Vec2 low{position.x - margin, position.y - margin}, high{position.x + margin, position.y + margin};
  out->are_complete = grid.contains(low) && grid.contains(high) && grid.cell_x(low.x) == grid.cell_x(high.x) &&
                      grid.cell_y(low.y) == grid.cell_y(high.y);
  if (!out->are_complete) return;
  const std::size_t cell = static_cast<std::size_t>(grid.cell_y(position.y)) * static_cast<std::size_t>(grid.num_x) +
                           static_cast<std::size_t>(grid.cell_x(position.x));
  any_in_cell(cell, position, z, [&](int32_t quad) {
    out->quads.push_back(quad);
    return false;
  });
}

bool Surface::is_folded_over(const Candidates& near, const Eigen::Vector2d& p, double z, int32_t band, std::size_t from,
                             double reach_m) const {
  const double s_m = quads_[first_quads_[band] + from].s_m;
  const auto covers_far = [&](const Quad& quad) {
    return quad.band == band && std::abs(quad.s_m - s_m) > reach_m && contains(quad, p, z);
  };
  if (!near.are_complete) return any_quad_at(p, z, covers_far);
  return std::any_of(near.quads.begin(), near.quads.end(), [&](int32_t quad) { return covers_far(quads_[quad]); });
}

/// Tests two triangles, so that a quad that is not convex covers the area that is drawn.
bool Surface::covers(const Quad& quad, const Eigen::Vector2d& p) {
  const Eigen::Vector2d* c = quad.corners_m;
  return in_triangle(c[0], c[1], c[2], p) || in_triangle(c[0], c[2], c[3], p);
}

}  // namespace pictura
