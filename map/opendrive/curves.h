// Positions relative to a reference line: OpenDRIVE's lines, arcs, spirals and plane cubics, and the cubics for
// elevation, banking, offsets and widths. In double, in file coordinates.
#pragma once

#include <cmath>
#include <limits>

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  Eigen::Vector2d position_m{0, 0};
  double heading = 0, curvature = 0;
  double stretch = 1;  // metres of the line for each metre of s: of deformed roads
};

/// Fills the table of arc lengths of a cubic up to its p_end.
void measure(PlaneCubic* cubic);

/// Fills the integration panels of a spiral; other pieces have none.
void measure(GeometryPiece* piece);

/// The pose at distance `ds` from the start of a piece: exact for lines and arcs, Gauss-Legendre quadrature for
/// spirals, which must be measured first. Plane cubics are parametrised by arc length, scaled so that they end where
/// the piece ends.
Pose pose_on(const GeometryPiece& piece, double ds);

/// The pose of the reference line at s; s is clamped to the road.
Pose pose_at(const FileRoad& road, double s);

/// Where a deformed road has the point that was at s of its reference line; of another road that point.
Eigen::Vector2d deformed_point(const FileRoad& road, double s, const Eigen::Vector2d& point_m);

/// Length of the reference line from `begin` to `end`: their difference unless the road is deformed.
double length_between(const FileRoad& road, double begin, double end);

/// A place on the reference line: its position, the unit vector to its left, and its elevation.
struct Station {
  double s = 0;
  Eigen::Vector2d position_m{0, 0}, left{0, 1};
  double elevation_m = 0;
};

/// The direction of the heading that was asked last: all of a straight line is alike.
class LastDirection {
 public:
  /// (cos, sin) of the heading.
  const Eigen::Vector2d& of(double heading) {
    if (heading != heading_) {
      heading_ = heading;
      direction_ = {std::cos(heading), std::sin(heading)};
    }
    return direction_;
  }

 private:
  double heading_ = std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector2d direction_{0, 0};
};

/// The last thousand stations of the road that was asked last: lanes beside each other, and both sides of each, are
/// sampled at the same ones.
class StationCache {
 public:
  const Station& at(const FileRoad& road, double s);

 private:
  static constexpr int kLogSize = 10;

  const FileRoad* road_ = nullptr;
  std::vector<Station> stations_;  // by a hash of s; NaN: free
  LastDirection direction_;
};

/// The point `t` metres to the left of the reference line at s, measured along the banked road surface, with its
/// height. s is clamped to the road.
Eigen::Vector3d point_at(const FileRoad& road, double s, double t);
Eigen::Vector3d point_at(const FileRoad& road, double s, double t, StationCache* cache);

/// The point on a lane at s: `outer_fraction` is 0 on the inner border and 1 on the outer one. Includes the lane's
/// <height>.
Eigen::Vector3d point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                              double outer_fraction, StationCache* cache);

/// Heading of the line midway between two borders, in the direction of growing s.
double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s);

/// A lane border at some s: its lateral position, and the derivative of that with respect to s.
struct Border {
  double t = 0, slope = 0;
};

/// Border 0 is the center line, border k (-k) the outer border of lane k (-k). Negative widths count as 0; a border
/// that would lie inside the previous one coincides with it.
Border border_at(const FileRoad& road, const FileSection& section, int border, double s);

/// Width of a lane at s, measured along the banked surface.
double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s);

/// The inner border of a lane.
constexpr int inner_border(int lane_id) { return lane_id > 0 ? lane_id - 1 : lane_id + 1; }

/// Every s in [begin, end] at which a formula changes: geometry pieces, cubics of elevation, banking and lane offset,
/// and the widths and heights of lanes up to `border`. Sorted, including begin and end.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

/// The same breaks, with bounds of the second derivative of the lane's width and of points on it, borders included, or
/// up to `beyond_m` beside them.
CurveBreaks breaks_of(const FileRoad& road, const FileSection& section, int lane, double begin, double end,
                      double beyond_m = 0);

}  // namespace pictura::opendrive
