// Tests whether walls hide a vehicle from an eye.
#pragma once

#include <optional>

#include "pictura/common/grid.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// Returns where segment c-d crosses segment a-b, as a fraction of a-b, if they cross.
std::optional<float> crossing_fraction(Vec2 a, Vec2 b, Vec2 c, Vec2 d);

/// The walls must outlive this object.
class LineOfSight {
 public:
  explicit LineOfSight(Span<const WallFace> walls);

  /// Whether walls hide nine points of a box at half its height: corners, middles of sides and centre.
  bool is_hidden(Vec3 eye_m, const AgentBox& box) const;

 private:
  bool is_blocked(Vec3 from, Vec3 to) const;

  Span<const WallFace> walls_;
  Grid grid_;
};

}  // namespace pictura
