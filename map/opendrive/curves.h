// Positions relative to a reference line, which consists of OpenDRIVE's lines, arcs, spirals and plane cubics; and the
// cubics for elevation, banking, offsets and widths. Numbers are doubles in file coordinates.
#pragma once

#include <cmath>
#include <limits>

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  Eigen::Vector2d position_m{0, 0};
  double heading = 0, curvature = 0;
  double stretch = 1;  // metres of the line per metre of s; 1 except on deformed roads
};

/// Fills the table of arc lengths of a cubic up to its p_end.
void measure(PlaneCubic* cubic);

/// Fills the integration panels of a spiral. Does nothing for other pieces, which have none.
void measure(GeometryPiece* piece);

/// Pose at distance `ds` from the start of a piece: exact for lines and arcs, Gauss-Legendre quadrature for spirals,
/// which must be measured first. Plane cubics are parametrised by arc length, scaled so that their end is the end of
/// the piece.
Pose pose_on(const GeometryPiece& piece, double ds);

/// Returns the pose of the reference line at s, which is clamped to the road.
Pose pose_at(const FileRoad& road, double s);

/// Moves a point at s to its place on a deformed road; returns the point unchanged on other roads.
Eigen::Vector2d deformed_point(const FileRoad& road, double s, const Eigen::Vector2d& point_m);

/// Returns the length of the reference line between the stations `begin` and `end`; it is their difference except on
/// deformed roads.
double length_between(const FileRoad& road, double begin, double end);

/// A place on the reference line: its position, the unit vector to its left, and its elevation.
struct Station {
  double s = 0;
  Eigen::Vector2d position_m{0, 0}, left{0, 1};
  double elevation_m = 0;
};

/// Cache of the direction of the last heading, since the heading is constant along a straight line.
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

/// Cache of the last thousand stations of the current road, since neighbouring lanes and both sides of each lane are
/// sampled at the same stations.
class StationCache {
 public:
  const Station& at(const FileRoad& road, double s);

 private:
  static constexpr int kLogSize = 10;

  const FileRoad* road_ = nullptr;
  std::vector<Station> stations_;  // indexed by a hash of s; NaN: free
  LastDirection direction_;
};

/// Point `t` metres to the left of the reference line at s, measured along the banked road surface, with its height. s
/// is clamped to the road.
Eigen::Vector3d point_at(const FileRoad& road, double s, double t);
Eigen::Vector3d point_at(const FileRoad& road, double s, double t, StationCache* cache);

/// Point on a lane at s: `outer_fraction` is 0 on the inner border and 1 on the outer border. Includes the lane's
/// <height>.
Eigen::Vector3d point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                              double outer_fraction, StationCache* cache);

/// Heading of the line midway between two borders, in the direction of growing s.
double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s);

/// A lane border at s: its lateral position and the derivative of that position by s.
struct Border {
  double t = 0, slope = 0;
};

/// Lane border at s. Border 0 is the centre line, border k (-k) the outer border of lane k (-k). Negative widths count
/// as 0; a border that would lie inside the previous border coincides with it.
Border border_at(const FileRoad& road, const FileSection& section, int border, double s);

/// Width of a lane at s, measured along the banked surface.
double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s);

/// Id of the lane whose outer border is the inner border of a lane.
constexpr int inner_border(int lane_id) { return lane_id > 0 ? lane_id - 1 : lane_id + 1; }

/// Returns every s in [begin, end] at which a formula changes: geometry pieces, cubics of elevation, banking and lane
/// offset, and the widths and heights of lanes up to `border`. Sorted, including begin and end.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

/// Returns the breaks of formula_changes(), and for each interval upper bounds of two second derivatives: of the lane's
/// width, and of the positions of points on the lane, its borders, and up to `beyond_m` outside them.
CurveBreaks breaks_of(const FileRoad& road, const FileSection& section, int lane, double begin, double end,
                      double beyond_m = 0);

}  // namespace pictura::opendrive
