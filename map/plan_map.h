// A linear map of the plan, by which copies of a map differ from it.
#pragma once

namespace pictura {

/// Takes (x, y) to (xx x + xy y, yx x + yy y); the identity by default.
struct PlanMap {
  double xx = 1, xy = 0, yx = 0, yy = 1;

  double determinant() const { return xx * yy - xy * yx; }
  bool operator==(const PlanMap&) const = default;
};

}  // namespace pictura
