// Positions relative to OpenDRIVE's reference lines, in doubles and file coordinates.
#pragma once

#include <cmath>
#include <limits>

#include "pictura/map/opendrive/model.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

struct Pose {
  Eigen::Vector2d position_m{0, 0};
  double heading = 0, curvature = 0;
  double stretch = 1;  // metres of the line per metre of s; 1 without deformation
};

/// Fills the table of arc lengths.
void measure(PlaneCubic* cubic);

/// Fills the integration panels of a spiral. Does nothing for other pieces.
void measure(GeometryPiece* piece);

/// Returns the pose at distance `ds` from the start of a piece. Spirals require an earlier measure(). On plane cubics,
/// the pose is at the fraction ds / piece.length of the cubic's arc length.
Pose pose_on(const GeometryPiece& piece, double ds);

/// Clamps s to the road.
Pose pose_at(const FileRoad& road, double s);

/// Applies the road's deformation, if any, to a point at station s.
Eigen::Vector2d deformed_point(const FileRoad& road, double s, const Eigen::Vector2d& point_m);

/// Returns the length of the reference line between two stations. It differs from `end` - `begin` only on deformed
/// roads.
double length_between(const FileRoad& road, double begin, double end);

/// A point of the reference line, with the unit vector to the left.
struct Station {
  double s = 0;
  Eigen::Vector2d position_m{0, 0}, left{0, 1};
  double elevation_m = 0;
};

/// Cache of (cos, sin) of the last heading, for straight lines.
class LastDirection {
 public:
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

/// Cache of stations of the current road, because neighbouring lanes are sampled at equal stations.
class StationCache {
 public:
  const Station& at(const FileRoad& road, double s);

 private:
  static constexpr int kLogSize = 10;

  const FileRoad* road_ = nullptr;
  std::vector<Station> stations_;  // indexed by a hash of s; s is NaN in unused entries
  LastDirection direction_;
};

/// Returns the point `t` metres to the left of the reference line, measured along the banked surface. Clamps s to the
/// road.
Eigen::Vector3d point_at(const FileRoad& road, double s, double t);
Eigen::Vector3d point_at(const FileRoad& road, double s, double t, StationCache* cache);

/// Returns a point on a lane, including its <height>. `outer_fraction` is 0 on the inner and 1 on the outer border.
Eigen::Vector3d point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                              double outer_fraction, StationCache* cache);

/// Returns the heading midway between two borders, towards growing s.
double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s);

/// Lateral position t of a lane border, and its derivative with respect to s.
struct Border {
  double t = 0, slope = 0;
};

/// Border 0 is the centre line, and border k is the outer border of lane k. Negative widths count as 0. Borders never
/// cross: a border inside the previous border coincides with it.
Border border_at(const FileRoad& road, const FileSection& section, int border, double s);

/// Returns the width along the banked surface.
double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s);

/// Returns the lane's inner border: the id of the next lane inwards, or 0.
constexpr int inner_border(int lane_id) { return lane_id > 0 ? lane_id - 1 : lane_id + 1; }

/// Returns `begin`, `end` and every s between them where a piece or cubic begins, sorted. Considers geometry,
/// elevation, banking, lane offset, and the widths and heights of lanes up to `border`.
std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end);

/// Returns formula_changes(). On roads without banking, the result also bounds the second derivatives of positions and
/// of half the lane's width. The bounds include positions up to `beyond_m` outside the lane.
CurveBreaks breaks_of(const FileRoad& road, const FileSection& section, int lane, double begin, double end,
                      double beyond_m = 0);

}  // namespace pictura::opendrive
