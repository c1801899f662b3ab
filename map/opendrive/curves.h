// Positions on and beside a reference line: OpenDRIVE's lines, arcs and spirals, and the cubics for heights, offsets
// and widths. In double and in the file's own coordinates.
#pragma once

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  double x = 0, y = 0, heading = 0, curvature = 0;
};

/// The pose `ds` behind the start of a piece: exact for lines and arcs, Gauss-Legendre quadrature for spirals.
Pose pose_on(const GeometryPiece& piece, double ds);

/// The pose of the reference line at s, which is clamped to the road.
Pose pose_at(const FileRoad& road, double s);

/// The point `t` metres to the left of the reference line at s, at the road's height.
Point3 point_at(const FileRoad& road, double s, double t);

/// Lateral position t of a lane's border at s. Border 0 is the center line, border k (-k) the outer border of lane k
/// (-k). Throws Error naming the lane whose width is negative there.
double border_t(const FileRoad& road, const FileSection& section, int border, double s);

/// How fast that t grows with s.
double border_slope(const FileRoad& road, const FileSection& section, int border, double s);

/// Width of a lane at s.
double lane_width(const FileSection& section, const FileLane& lane, double s);

/// Every s in [begin, end] at which a formula changes: pieces and cubics of the reference line, height and offset, and
/// the widths of lanes up to `border`. Sorted, with begin and end themselves.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

}  // namespace pictura::opendrive
