// Tests whether walls hide a vehicle from an eye.
#pragma once

#include <optional>

#include "pictura/common/grid.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// Returns the position on segment a-b where segment c-d crosses it, as a fraction of a-b. Returns nothing if the
/// segments do not cross.
std::optional<float> crossing_fraction(Vec2 a, Vec2 b, Vec2 c, Vec2 d);

/// Walls in a grid. The walls must outlive this object.
class LineOfSight {
 public:
  explicit LineOfSight(Span<const WallFace> walls);

  /// Whether walls block the lines of sight to all nine tested points of a box: its corners, the middles of its sides
  /// and its centre, all at half its height.
  bool is_hidden(Vec3 eye_m, const AgentBox& box) const;

 private:
  bool is_blocked(Vec3 from, Vec3 to) const;

  Span<const WallFace> walls_;
  Grid grid_;
};

}  // namespace pictura
