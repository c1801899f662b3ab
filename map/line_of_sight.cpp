#include "pictura/map/line_of_sight.h"

#include <vector>

namespace pictura {

std::optional<float> crossing_fraction(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const Vec2 along = b - a, across = d - c;
  const float area = cross(along, across);
  if (area == 0) return std::nullopt;
  const float fraction = cross(c - a, across) / area, other_fraction = cross(c - a, along) / area;
  if (fraction < 0 || fraction > 1 || other_fraction < 0 || other_fraction > 1) return std::nullopt;
  return fraction;
}

LineOfSight::LineOfSight(Span<const WallFace> walls) : walls_(walls) {
  constexpr float kCell_m = 10.0f;
  std::vector<Aabb2> boxes;
  for (const WallFace& wall : walls) boxes.push_back(ground_box(wall));
  if (!boxes.empty()) grid_ = Grid(boxes, kCell_m);
}

bool LineOfSight::is_hidden(Vec3 eye_m, const AgentBox& box) const {
  const Vec2 forward{box.cos_heading, box.sin_heading};
  for (int along = -1; along <= 1; ++along) {
    for (int side = -1; side <= 1; ++side) {
      const Vec2 xy = box.center_m.xy() + forward * (0.5f * box.length_m * static_cast<float>(along)) +
                      left_normal(forward) * (0.5f * box.width_m * static_cast<float>(side));
      if (!is_blocked(eye_m, {xy.x, xy.y, box.center_m.z + 0.5f * box.height_m})) return false;
    }
  }
  return true;
}

bool LineOfSight::is_blocked(Vec3 from, Vec3 to) const {
  if (walls_.empty()) return false;
  bool blocked = false;
  visit_items(grid_.view(), ground_box(WallFace{from, to}), [&](std::size_t i) {
    if (blocked) return;
    const WallFace& wall = walls_[i];
    const auto fraction = crossing_fraction(from.xy(), to.xy(), wall.a_m.xy(), wall.b_m.xy());
    if (!fraction) return;
    const float above_m = from.z + (to.z - from.z) * *fraction - 0.5f * (wall.a_m.z + wall.b_m.z);
    blocked = above_m >= 0 && above_m <= wall.height_m;
  });
  return blocked;
}

}  // namespace pictura
