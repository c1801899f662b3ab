// Line-of-sight tests between an eye and a vehicle, past walls.
#pragma once

#include <optional>

#include "pictura/common/grid.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// Returns the fraction of a-b at which c-d crosses it, if they cross.
std::optional<float> crossing_fraction(Vec2 a, Vec2 b, Vec2 c, Vec2 d);

/// Walls in a grid. The walls must outlive this object.
class LineOfSight {
 public:
  explicit LineOfSight(Span<const WallFace> walls);

  /// Whether walls block the view of a box: of its corners, the middles of its sides and its centre, at half its
  /// height.
  bool is_hidden(Vec3 eye_m, const AgentBox& box) const;

 private:
  bool is_blocked(Vec3 from, Vec3 to) const;

  Span<const WallFace> walls_;
  Grid grid_;
};

}  // namespace pictura
