// Positions relative to a reference line, which consists of OpenDRIVE's lines, arcs, spirals and plane cubics. Also
// values of the cubics of elevation, banking, offsets and widths. Numbers are doubles in file coordinates.
#pragma once

#include <cmath>
#include <limits>

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  Eigen::Vector2d position_m{0, 0};
  double heading = 0, curvature = 0;
  double stretch = 1;  // metres of the line per metre of s; 1 if the road is not deformed
};

/// Fills the table of arc lengths of a cubic up to its p_end.
void measure(PlaneCubic* cubic);

/// Fills the integration panels of a spiral. Does nothing for other pieces, because they have no panels.
void measure(GeometryPiece* piece);

/// Returns the pose at distance `ds` from the start of a piece. It is exact for lines and arcs. Spirals use
/// Gauss-Legendre quadrature, and require an earlier call of measure(). Plane cubics are parametrised by arc length,
/// which is scaled so that the cubic ends at the end of the piece.
Pose pose_on(const GeometryPiece& piece, double ds);

/// Returns the pose of the reference line at s, which is clamped to the road.
Pose pose_at(const FileRoad& road, double s);

/// Applies the deformation of a road to a point at station s. Returns the point unchanged if the road is not deformed.
Eigen::Vector2d deformed_point(const FileRoad& road, double s, const Eigen::Vector2d& point_m);

/// Returns the length of the reference line between the stations `begin` and `end`. It differs from `end` - `begin`
/// only on deformed roads.
double length_between(const FileRoad& road, double begin, double end);

/// A point of the reference line: its position, the unit vector to the left, and its elevation.
struct Station {
  double s = 0;
  Eigen::Vector2d position_m{0, 0}, left{0, 1};
  double elevation_m = 0;
};

/// Cache of the unit vector of the last heading. It is effective on straight lines, along which the heading is
/// constant.
class LastDirection {
 public:
  /// Returns (cos, sin) of the heading.
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

/// Cache of about a thousand stations of the current road. It is effective because neighbouring lanes and both borders
/// of a lane are sampled at the same stations.
class StationCache {
 public:
  const Station& at(const FileRoad& road, double s);

 private:
  static constexpr int kLogSize = 10;

  const FileRoad* road_ = nullptr;
  std::vector<Station> stations_;  // indexed by a hash of s; s is NaN in unused entries
  LastDirection direction_;
};

/// Returns the point `t` metres to the left of the reference line at s, with its height. The distance t is measured
/// along the banked road surface. s is clamped to the road.
Eigen::Vector3d point_at(const FileRoad& road, double s, double t);
Eigen::Vector3d point_at(const FileRoad& road, double s, double t, StationCache* cache);

/// Returns the point on a lane at s. `outer_fraction` is 0 on the inner border and 1 on the outer border. The lane's
/// <height> is included.
Eigen::Vector3d point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                              double outer_fraction, StationCache* cache);

/// Returns the heading of the line midway between the borders `inner` and `outer`, in the direction of growing s.
double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s);

/// A lane border at a station s: its lateral position t, and the derivative of t with respect to s.
struct Border {
  double t = 0, slope = 0;
};

/// Returns a lane border at s. Border 0 is the centre line. Border k is the outer border of lane k, on the left for k >
/// 0 and on the right for k < 0. Negative widths count as 0. A border that would be inside the previous border
/// coincides with the previous border.
Border border_at(const FileRoad& road, const FileSection& section, int border, double s);

/// Returns the width of a lane at s, measured along the banked surface.
double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s);

/// Returns the number of a lane's inner border. It is the id of the next lane inwards, or 0.
constexpr int inner_border(int lane_id) { return lane_id > 0 ? lane_id - 1 : lane_id + 1; }

/// Returns every s in [begin, end] at which a formula changes, sorted, including begin and end. Formulas change where
/// pieces of geometry begin, and where cubics of elevation, banking or lane offset begin. For the lanes up to `border`,
/// they also change where cubics of widths and heights begin.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

/// Returns the breaks of formula_changes(). Unless the road is banked, also returns an upper bound of the second
/// derivatives of the lane's width and of positions for each interval between breaks. The bound holds for positions on
/// the lane and up to `beyond_m` outside its borders.
CurveBreaks breaks_of(const FileRoad& road, const FileSection& section, int lane, double begin, double end,
                      double beyond_m = 0);

}  // namespace pictura::opendrive
