// Positions on and beside a reference line: OpenDRIVE's lines, arcs, spirals and plane cubics, and the cubics for
// heights, banking, offsets and widths. In double and in the file's own coordinates.
#pragma once

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  double x = 0, y = 0, heading = 0, curvature = 0;
};

/// Fills the lengths of a cubic along its p_end.
void measure(PlaneCubic* cubic);

/// Fills the panels of a spiral; other pieces have none.
void measure(GeometryPiece* piece);

/// The pose `ds` behind the start of a piece: exact for lines and arcs, Gauss-Legendre quadrature for spirals, which
/// must be measured. Plane cubics are passed evenly along their arc, so that their end is the piece's.
Pose pose_on(const GeometryPiece& piece, double ds);

/// The pose of the reference line at s, which is clamped to the road.
Pose pose_at(const FileRoad& road, double s);

/// The point `t` metres to the left of the reference line at s, along the banked road and at its height. s is clamped
/// to the road.
Point3 point_at(const FileRoad& road, double s, double t);

/// The same for a place on a lane: `outer_share` is 0 on its inner border, 1 on its outer one. Adds the lane's height.
Point3 point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                     double outer_share);

/// Heading of the line in the middle between two borders, towards growing s.
double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s);

/// A lane's border at one s: its lateral position, and how fast that grows with s.
struct Border {
  double t = 0, slope = 0;
};

/// Border 0 is the center line, border k (-k) the outer border of lane k (-k). Widths below 0 count as 0, and borders
/// that would lie inside the one before lie on it.
Border border_at(const FileRoad& road, const FileSection& section, int border, double s);

/// Width of a lane at s, along the banked road.
double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s);

/// The border on the inside of a lane.
constexpr int inner_border(int lane_id) { return lane_id > 0 ? lane_id - 1 : lane_id + 1; }

/// Every s in [begin, end] at which a formula changes: pieces and cubics of the reference line, heights and offset, and
/// the widths and heights of lanes up to `border`. Sorted, with begin and end themselves.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

}  // namespace pictura::opendrive
