#include "pictura/common/scene.h"

#include <cmath>

#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr float kGeometryCell_m = 20.0f;
// A mitre longer than this many half-widths (a turn sharper than about 150 degrees) is cut back.
constexpr float kMaxMiter = 4.0f;

Vec2 unit(Vec2 v) { return v * (1.0f / length(v)); }

}  // namespace

void StaticGeometry::build_grids() {
  std::vector<Aabb2> boxes;
  for (const Strip& strip : strips) boxes.push_back(ground_box(strip));
  strip_grid = Grid(boxes, kGeometryCell_m);
  boxes.clear();
  for (const WallFace& wall : walls) boxes.push_back(ground_box(wall));
  wall_grid = Grid(boxes, kGeometryCell_m);
}

AgentBox make_box(AgentClass agent_class, Vec3 center_m, float heading_rad, Vec3 size_m) {
  const SinCos heading = sincos_of(heading_rad);
  AgentBox box;
  box.center_m = center_m;
  box.cos_heading = heading.cos;
  box.sin_heading = heading.sin;
  box.length_m = size_m.x;
  box.width_m = size_m.y;
  box.height_m = size_m.z;
  box.agent_class = agent_class;
  return box;
}

View make_view(Vec3 origin_m, float heading_rad) {
  const SinCos heading = sincos_of(heading_rad);
  View view;
  view.origin_m = origin_m;
  view.cos_heading = heading.cos;
  view.sin_heading = heading.sin;
  return view;
}

void append_strips(Span<const Vec3> points_m, float width_m, Rgb color, StripKind kind,
                   std::vector<Strip>* strips_out) {
  PICTURA_CHECK(points_m.size() >= 2, "polyline: expected at least two points, got {}", points_m.size());

  // The polyline's points without repeated points, and with points added so that no piece is longer than kMaxPiece_m.
  std::vector<Vec3> points{points_m[0]};
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    const Vec3 a = points.back(), b = points_m[i];
    const float piece_m = length(b.xy() - a.xy());
    if (piece_m < kRepeatedPoint_m) continue;
    const int pieces = static_cast<int>(std::ceil(piece_m / kMaxPiece_m));
    for (int k = 1; k <= pieces; ++k) {
      points.push_back(k == pieces ? b : a + (b - a) * (static_cast<float>(k) / static_cast<float>(pieces)));
    }
  }
  if (points.size() < 2) return;

  // Side vector of a point: at the ends of the polyline, the left normal; elsewhere, the mitre between the point's two
  // pieces. A closed polyline is mitred at its first point too.
  const std::size_t last = points.size() - 1;
  const bool closed = last >= 3 && length(points[last] - points[0]) < kRepeatedPoint_m;
  auto piece_left = [&](std::size_t i) { return left_normal(unit(points[i + 1].xy() - points[i].xy())); };
  auto mitre = [&](Vec2 before, Vec2 after) {
    const Vec2 sum = before + after;
    const float scale = 2.0f / max_of(dot(sum, sum), 4.0f / square(kMaxMiter));
    return sum * scale;
  };
  auto side = [&](std::size_t i) {
    if (i == 0) return closed ? mitre(piece_left(last - 1), piece_left(0)) : piece_left(0);
    if (i == last) return closed ? mitre(piece_left(last - 1), piece_left(0)) : piece_left(last - 1);
    return mitre(piece_left(i - 1), piece_left(i));
  };
  for (std::size_t i = 0; i < last; ++i) {
    strips_out->push_back({points[i], points[i + 1], side(i), side(i + 1), width_m, color, kind});
  }
}

}  // namespace pictura
