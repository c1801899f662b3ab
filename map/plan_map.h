// The linear transformation of the ground plane that makes an affine copy of a map.
#pragma once

namespace pictura {

/// Maps (x, y) to (xx x + xy y, yx x + yy y).
struct PlanMap {
  double xx = 1, xy = 0, yx = 0, yy = 1;

  double determinant() const { return xx * yy - xy * yx; }
  bool operator==(const PlanMap&) const = default;
};

}  // namespace pictura
