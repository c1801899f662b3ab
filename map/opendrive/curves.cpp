#include "pictura/map/opendrive/curves.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "pictura/common/hypot.h"

namespace pictura::opendrive {

namespace {

// Stations are clamped to this distance inside a section. So at a section's end, the cubics of this section are
// evaluated, not those of the adjacent section.
constexpr double kSectionMargin_m = 1e-5;
// Maximum turn of an integration panel of a spiral. Up to this turn, five Gauss points are exact except for rounding.
constexpr double kPanelTurn_rad = 0.5;

struct GaussPoint {
  double position, weight;  // position and weight on [0, 1]
};
constexpr GaussPoint kGauss[5] = {{0.046910077030668004, 0.11846344252809454},
                                  {0.23076534494715845, 0.23931433524968324},
                                  {0.5, 0.28444444444444444},
                                  {0.76923465505284155, 0.23931433524968324},
                                  {0.95308992296933200, 0.11846344252809454}};

/// Returns the last element of `items` whose s is at most `s`, or the first element.
template <typename Item>
const Item& last_item_at(const std::vector<Item>& items, double s) {
  const auto after =
      std::upper_bound(items.begin(), items.end(), s, [](double x, const Item& item) { return x < item.s; });
  return after == items.begin() ? items.front() : *(after - 1);
}

/// Clamps `s` to just inside the section, because offsets and widths may jump where sections meet.
double clamp_inside(const FileSection& section, double s) {
  const double margin = std::min(kSectionMargin_m, 0.5 * (section.end - section.s));
  return std::clamp(s, section.s + margin, section.end - margin);
}

/// Returns t of a lane's outer border; `inner` is t of its inner border.
double beyond_lane(const FileLane& lane, double ds, double sign, double inner) {
  if (lane.border.cubics.empty()) {
    const double width = lane.width.value(ds);
    return width < 0 ? inner : inner + sign * width;
  }
  const double t = lane.border.value(ds);
  return sign * t < sign * inner ? inner : t;
}

/// sin(x) / x.
double sinc(double x) { return std::abs(x) < 1e-6 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

double value_of(const std::array<double, 4>& c, double p) { return c[0] + p * (c[1] + p * (c[2] + p * c[3])); }
double derivative_of(const std::array<double, 4>& c, double p) { return c[1] + p * (2 * c[2] + p * 3 * c[3]); }
double second_derivative_of(const std::array<double, 4>& c, double p) { return 2 * c[2] + p * 6 * c[3]; }

double speed_of(const PlaneCubic& cubic, double p) {
  return hypot_of(derivative_of(cubic.u, p), derivative_of(cubic.v, p));
}

double length_between(const PlaneCubic& cubic, double from, double to) {
  double sum = 0;
  for (const GaussPoint& gauss : kGauss) sum += gauss.weight * speed_of(cubic, from + gauss.position * (to - from));
  return sum * (to - from);
}

/// Returns the p at the given fraction of the curve's length, by Newton's method within one interval of the arc-length
/// table.
double parameter_at(const PlaneCubic& cubic, double fraction) {
  const auto& lengths = cubic.arc_length;
  const double target = std::clamp(fraction, 0.0, 1.0) * lengths.back();
  const std::size_t panels = lengths.size() - 1;
  std::size_t panel = 0;
  while (panel + 1 < panels && lengths[panel + 1] < target) ++panel;
  const double low = cubic.p_end * static_cast<double>(panel) / static_cast<double>(panels);
  const double high = cubic.p_end * static_cast<double>(panel + 1) / static_cast<double>(panels);
  double p = low;
  for (int step = 0; step < 8; ++step) {
    const double remaining = target - lengths[panel] - length_between(cubic, low, p);
    const double speed = speed_of(cubic, p);
    if (speed < 1e-9 || std::abs(remaining) < 1e-12) break;
    p = std::clamp(p + remaining / speed, low, high);
  }
  return p;
}

/// Converts a point in the frame of the piece's start to file coordinates.
Eigen::Vector2d in_file(const GeometryPiece& piece, const Eigen::Vector2d& p) {
  const double c = std::cos(piece.heading), s = std::sin(piece.heading);
  // The sum is evaluated from left to right, because another order would change the bits of imported maps.
  return Eigen::Vector2d{piece.x, piece.y} + p.x() * Eigen::Vector2d{c, s} + p.y() * Eigen::Vector2d{-s, c};
}

Pose pose_on_cubic(const GeometryPiece& piece, double ds) {
  const PlaneCubic& cubic = *piece.cubic;
  const double p = parameter_at(cubic, ds / piece.length);
  const double u = value_of(cubic.u, p), v = value_of(cubic.v, p);
  const double du = derivative_of(cubic.u, p), dv = derivative_of(cubic.v, p);
  const double speed = std::max(speed_of(cubic, p), 1e-9);
  return {in_file(piece, {u, v}), piece.heading + std::atan2(dv, du),
          (du * second_derivative_of(cubic.v, p) - dv * second_derivative_of(cubic.u, p)) / (speed * speed * speed)};
}

double shape_height(const std::vector<CrossSection>& shape, double s, double t) {
  if (shape.empty()) return 0;
  const CrossSection& before = last_item_at(shape, s);
  const std::size_t index = static_cast<std::size_t>(&before - shape.data());
  const double here = before.height.value(t);
  if (s <= before.s || index + 1 == shape.size()) return here;
  const CrossSection& after = shape[index + 1];
  return here + (s - before.s) / (after.s - before.s) * (after.height.value(t) - here);
}

bool has_banking(const FileRoad& road) {
  return !(road.superelevation.cubics.empty() && road.left_crossfall.cubics.empty() &&
           road.right_crossfall.cubics.empty() && road.shape.empty());
}

/// Returns `t`, clamped to the inner border of the first lane on its side that has the attribute `level`.
double banked_t(const FileRoad& road, double s, double t) {
  const FileSection& section = last_item_at(road.sections, s);
  for (const FileLane& lane : t > 0 ? section.left : section.right) {
    if (!lane.is_level) continue;
    const double border = border_at(road, section, inner_border(lane.id), s).t;
    return t > 0 ? std::min(t, border) : std::max(t, border);
  }
  return t;
}

/// Returns the change of heading of a spiral from its start to `ds`.
double spiral_turn(const GeometryPiece& piece, double ds) {
  const double rate = (piece.end_curvature - piece.start_curvature) / piece.length;
  return ds * (piece.start_curvature + 0.5 * rate * ds);
}

/// Returns the displacement between two positions on a spiral within one panel, in the frame of the spiral's start.
Eigen::Vector2d spiral_step(const GeometryPiece& piece, double from, double to) {
  Eigen::Vector2d sum{0, 0};
  for (const GaussPoint& gauss : kGauss) {
    const double turn = spiral_turn(piece, from + gauss.position * (to - from));
    sum += gauss.weight * Eigen::Vector2d{std::cos(turn), std::sin(turn)};
  }
  return sum * (to - from);
}

Pose pose_on(const GeometryPiece& piece, double ds, LastDirection* last) {
  if (piece.cubic) return pose_on_cubic(piece, ds);
  const double k0 = piece.start_curvature;
  const double rate = (piece.end_curvature - k0) / piece.length;
  if (rate == 0) {
    // The heading of an arc's chord is the mean of the headings at its ends.
    const double half_turn = 0.5 * k0 * ds;
    const double chord = ds * sinc(half_turn);
    return {Eigen::Vector2d{piece.x, piece.y} + chord * last->of(piece.heading + half_turn), piece.heading + k0 * ds,
            k0};
  }
  const auto last_panel = static_cast<double>(piece.panels.size() - 1);
  const double panel = std::min(last_panel, std::floor(ds / piece.length * (last_panel + 1)));
  const auto& [begin_x, begin_y] = piece.panels[panel];
  const Eigen::Vector2d in_frame =
      Eigen::Vector2d{begin_x, begin_y} + spiral_step(piece, panel * piece.length / (last_panel + 1), ds);
  return {in_file(piece, in_frame), piece.heading + spiral_turn(piece, ds), k0 + rate * ds};
}

/// Shift of a deformed road at s, and the first two derivatives of the shift with respect to s.
struct Shift {
  Eigen::Vector2d value_m{0, 0}, slope{0, 0}, bend{0, 0};
};

Shift shift_at(const FileRoad& road, double s) {
  const RoadDeformation& deformation = *road.deformation;
  const Eigen::Vector2d start{deformation.start_shift_m[0], deformation.start_shift_m[1]};
  const Eigen::Vector2d change = Eigen::Vector2d{deformation.end_shift_m[0], deformation.end_shift_m[1]} - start;
  if (!(road.length > 0)) return {start};
  const double x = std::clamp(s / road.length, 0.0, 1.0);
  return {start + x * x * (3 - 2 * x) * change, 6 * x * (1 - x) / road.length * change,
          (6 - 12 * x) / (road.length * road.length) * change};
}

Eigen::Matrix2d plan_of(const FileRoad& road) {
  const PlanMap& plan = road.deformation->plan;
  return Eigen::Matrix2d{{plan.xx, plan.xy}, {plan.yx, plan.yy}};
}

Pose deformed(const FileRoad& road, double s, const Pose& pose) {
  const Eigen::Matrix2d plan = plan_of(road);
  const Shift shift = shift_at(road, s);
  const Eigen::Vector2d along{std::cos(pose.heading), std::sin(pose.heading)}, left{-along.y(), along.x()};
  const Eigen::Vector2d first = plan * along + shift.slope, second = pose.curvature * (plan * left) + shift.bend;
  const double stretch = std::max(first.norm(), 1e-9);
  return {plan * pose.position_m + shift.value_m, std::atan2(first.y(), first.x()),
          (first.x() * second.y() - first.y() * second.x()) / (stretch * stretch * stretch), stretch};
}

Pose pose_at(const FileRoad& road, double s, LastDirection* last) {
  const GeometryPiece& piece = last_item_at(road.geometry, s);
  const Pose pose = pose_on(piece, std::clamp(s - piece.s, 0.0, piece.length), last);
  return road.deformation ? deformed(road, s, pose) : pose;
}

Station station_at(const FileRoad& road, double s, LastDirection* last) {
  const Pose pose = pose_at(road, s, last);
  const Eigen::Vector2d& along = last->of(pose.heading);
  return {s, pose.position_m, {-along.y(), along.x()}, road.elevation.value(s)};
}

Eigen::Vector3d point_beside(const FileRoad& road, const Station& station, double t) {
  const double s = station.s;
  double lateral = t, z = station.elevation_m;
  if (has_banking(road)) {
    const double banked = banked_t(road, s, t);
    const double roll = road.superelevation.value(s);
    const double fall = (t > 0 ? road.left_crossfall : road.right_crossfall).value(s);
    lateral = t - banked + banked * std::cos(roll);
    z += banked * std::sin(roll) - std::abs(banked) * std::tan(fall) + shape_height(road.shape, s, banked);
  }
  const Eigen::Vector2d p = station.position_m + lateral * station.left;
  return {p.x(), p.y(), z};
}

/// Bounds of a cubic over an interval: the range of its value, and the maximum magnitudes of its first and second
/// derivatives (slope and bend).
struct Bounds {
  double low = 0, high = 0, slope = 0, bend = 0;
};

/// Computes the bounds from Bernstein coefficients, because these bound a polynomial.
Bounds bounds_between(const Profile& profile, double begin, double end) {
  if (profile.cubics.empty()) return {};
  const Cubic& cubic = last_item_at(profile.cubics, 0.5 * (begin + end));
  const double x = begin - cubic.s, h = end - begin;
  const double a = cubic.a + x * (cubic.b + x * (cubic.c + x * cubic.d));
  const double b = h * (cubic.b + x * (2 * cubic.c + x * 3 * cubic.d)), c = h * h * (cubic.c + x * 3 * cubic.d);
  const double d = h * h * h * cubic.d;
  const double points[4] = {a, a + b / 3, a + (2 * b + c) / 3, a + b + c + d};
  Bounds bounds{.low = points[0], .high = points[0]};
  for (int i = 0; i < 4; ++i) {
    bounds.low = std::min(bounds.low, points[i]);
    bounds.high = std::max(bounds.high, points[i]);
    if (i > 0) bounds.slope = std::max(bounds.slope, 3 * std::abs(points[i] - points[i - 1]) / h);
  }
  bounds.bend = std::max(std::abs(2 * c), std::abs(2 * c + 6 * d)) / (h * h);
  return bounds;
}

/// Returns an upper bound of the second derivative of positions with respect to s, between two breaks. The bound holds
/// for points on a lane and up to `beyond_m` outside its borders. A point is c + t n, where c is the reference line
/// with normal n and curvature k, and t is the lateral position. The second derivative has the components k't + 2kt'
/// along the line and k(1 - kt) + t'' across it.
double bend_between(const FileRoad& road, const FileSection& section, int lane, double beyond_m, double begin,
                    double end) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  constexpr double kZero_m = -1e-9;  // negative widths count as zero, so the width has a kink there
  const GeometryPiece& piece = last_item_at(road.geometry, 0.5 * (begin + end));
  if (piece.cubic || road.deformation || end <= begin) return kUnknown;
  const Bounds offset = bounds_between(road.lane_offset, begin, end);
  // near, far: distances of the lane's borders from lane 0.
  double near = 0, far = 0, slope = offset.slope, bend = offset.bend;
  const std::vector<FileLane>& side = lane > 0 ? section.left : section.right;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::abs(lane)); ++i) {
    if (!side[i].border.cubics.empty()) return kUnknown;
    const Bounds width = bounds_between(side[i].width, begin - section.s, end - section.s);
    if (!(width.low >= kZero_m)) return kUnknown;
    if (i + 1 < static_cast<std::size_t>(std::abs(lane))) near += width.low;
    far += width.high;
    slope += width.slope;
    bend += width.bend;
  }
  const double t_low = offset.low + (lane > 0 ? near : -far) - beyond_m;
  const double t_high = offset.high + (lane > 0 ? far : -near) + beyond_m;
  double k = 0, across = 0;
  for (const double curvature : {piece.start_curvature, piece.end_curvature}) {
    k = std::max(k, std::abs(curvature));
    for (const double t : {t_low, t_high}) across = std::max(across, std::abs(curvature * (1 - curvature * t)));
  }
  const double change = std::abs(piece.end_curvature - piece.start_curvature) / piece.length;
  // For a spiral, k(1 - kt) may be largest between the breaks.
  if (change > 0) across = k * (1 + k * std::max(std::abs(t_low), std::abs(t_high)));
  return change * std::max(std::abs(t_low), std::abs(t_high)) + 2 * k * slope + across + bend +
         bounds_between(road.elevation, begin, end).bend;
}

}  // namespace

void measure(GeometryPiece* piece) {
  piece->panels.clear();
  if (piece->cubic || piece->start_curvature == piece->end_curvature) return;
  const double turn = std::max(std::abs(piece->start_curvature), std::abs(piece->end_curvature)) * piece->length;
  const int count = 1 + static_cast<int>(turn / kPanelTurn_rad);
  Eigen::Vector2d position{0, 0};
  for (int i = 0; i < count; ++i) {
    piece->panels.push_back({position.x(), position.y()});
    position += spiral_step(*piece, i * piece->length / count, (i + 1) * piece->length / count);
  }
}

void measure(PlaneCubic* cubic) {
  const std::size_t panels = cubic->arc_length.size() - 1;
  for (std::size_t i = 0; i < panels; ++i) {
    const double step = cubic->p_end / static_cast<double>(panels);
    cubic->arc_length[i + 1] =
        cubic->arc_length[i] + length_between(*cubic, static_cast<double>(i) * step, static_cast<double>(i + 1) * step);
  }
}

double Profile::value(double s) const {
  if (cubics.empty() || s < cubics.front().s - 1e-6) return 0;
  const Cubic& cubic = last_item_at(cubics, s);
  const double ds = s - cubic.s;
  return cubic.a + ds * (cubic.b + ds * (cubic.c + ds * cubic.d));
}

double Profile::slope(double s) const {
  if (cubics.empty() || s < cubics.front().s - 1e-6) return 0;
  const Cubic& cubic = last_item_at(cubics, s);
  const double ds = s - cubic.s;
  return cubic.b + ds * (2 * cubic.c + ds * 3 * cubic.d);
}

Pose pose_on(const GeometryPiece& piece, double ds) {
  LastDirection none;
  return pose_on(piece, ds, &none);
}

Pose pose_at(const FileRoad& road, double s) {
  LastDirection none;
  return pose_at(road, s, &none);
}

Eigen::Vector2d deformed_point(const FileRoad& road, double s, const Eigen::Vector2d& point_m) {
  if (!road.deformation) return point_m;
  return plan_of(road) * point_m + shift_at(road, s).value_m;
}

double length_between(const FileRoad& road, double begin, double end) {
  if (!road.deformation) return end - begin;
  constexpr double kPanel_m = 2;
  const int panels = 1 + static_cast<int>((end - begin) / kPanel_m);
  const double step = (end - begin) / panels;
  double sum = 0;
  for (int i = 0; i < panels; ++i) {
    for (const GaussPoint& gauss : kGauss) {
      sum += gauss.weight * pose_at(road, begin + (i + gauss.position) * step).stretch;
    }
  }
  return sum * step;
}

const Station& StationCache::at(const FileRoad& road, double s) {
  if (road_ != &road) {
    road_ = &road;
    stations_.assign(std::size_t{1} << kLogSize, {.s = std::numeric_limits<double>::quiet_NaN()});
  }
  constexpr std::uint64_t kMultiplier = 0x9e3779b97f4a7c15;  // Fibonacci hashing
  Station& station = stations_[(std::bit_cast<std::uint64_t>(s) * kMultiplier) >> (64 - kLogSize)];
  if (station.s != s) station = station_at(road, s, &direction_);
  return station;
}

Eigen::Vector3d point_at(const FileRoad& road, double s, double t) {
  s = std::clamp(s, 0.0, road.length);
  LastDirection none;
  return point_beside(road, station_at(road, s, &none), t);
}

Eigen::Vector3d point_at(const FileRoad& road, double s, double t, StationCache* cache) {
  return point_beside(road, cache->at(road, std::clamp(s, 0.0, road.length)), t);
}

Eigen::Vector3d point_on_lane(const FileRoad& road, const FileSection& section, const FileLane& lane, double s,
                              double outer_fraction, StationCache* cache) {
  const double here = clamp_inside(section, s), ds = here - section.s;
  const double sign = lane.id > 0 ? 1 : -1;
  const std::vector<FileLane>& side = lane.id > 0 ? section.left : section.right;
  double outer = road.lane_offset.value(here), inner = outer;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::abs(lane.id)); ++i) {
    inner = outer;
    outer = beyond_lane(side[i], ds, sign, outer);
  }
  Eigen::Vector3d point = point_at(road, s, outer - (1 - outer_fraction) * (outer - inner), cache);
  if (!lane.inner_height.cubics.empty()) {
    point.z() += (1 - outer_fraction) * lane.inner_height.value(ds) + outer_fraction * lane.outer_height.value(ds);
  }
  return point;
}

double heading_between(const FileRoad& road, const FileSection& section, int inner, int outer, double s) {
  const Border in = border_at(road, section, inner, s), out = border_at(road, section, outer, s);
  const double t = 0.5 * (in.t + out.t), slope = 0.5 * (in.slope + out.slope);
  const double roll = road.superelevation.value(s);
  const double lateral = t * std::cos(roll);
  const double lateral_slope = slope * std::cos(roll) - t * std::sin(roll) * road.superelevation.slope(s);
  const Pose pose = pose_at(road, s);
  // A lateral slope turns the line away from the reference line, and turns it more on the inside of a curve. Slopes are
  // derivatives of the cubics, not differences, because files have steps between cubics.
  return pose.heading + std::atan2(lateral_slope, pose.stretch * (1.0 - pose.curvature * lateral));
}

double lane_width(const FileRoad& road, const FileSection& section, const FileLane& lane, double s) {
  if (lane.border.cubics.empty()) return std::max(lane.width.value(clamp_inside(section, s) - section.s), 0.0);
  return std::abs(border_at(road, section, lane.id, s).t - border_at(road, section, inner_border(lane.id), s).t);
}

Border border_at(const FileRoad& road, const FileSection& section, int border, double s) {
  const double here = clamp_inside(section, s);
  const double sign = border > 0 ? 1 : -1;
  const std::vector<FileLane>& side = border > 0 ? section.left : section.right;
  Border result{road.lane_offset.value(here), road.lane_offset.slope(here)};
  const double ds = here - section.s;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::abs(border)); ++i) {
    if (side[i].border.cubics.empty()) {
      const double width = side[i].width.value(ds);
      if (width < 0) continue;
      result.t += sign * width;
      result.slope += sign * side[i].width.slope(ds);
    } else {
      const double t = side[i].border.value(ds);
      if (sign * t < sign * result.t) continue;
      result = {t, side[i].border.slope(ds)};
    }
  }
  return result;
}

std::vector<double> formula_changes(const FileRoad& road, const FileSection& section, int border, double begin,
                                    double end) {
  std::vector<double> changes{begin};
  auto add_all = [&](const auto& items, double offset) {
    auto item = std::upper_bound(items.begin(), items.end(), begin - offset,
                                 [](double s, const auto& candidate) { return s < candidate.s; });
    for (; item != items.end() && item->s + offset < end; ++item) changes.push_back(item->s + offset);
  };
  add_all(road.geometry, 0);
  for (const Profile* profile :
       {&road.elevation, &road.lane_offset, &road.superelevation, &road.left_crossfall, &road.right_crossfall}) {
    add_all(profile->cubics, 0);
  }
  add_all(road.shape, 0);
  const std::vector<FileLane>& side = border > 0 ? section.left : section.right;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::abs(border)); ++i) {
    for (const Profile* profile : {&side[i].width, &side[i].border, &side[i].inner_height}) {
      add_all(profile->cubics, section.s);
    }
  }
  std::sort(changes.begin() + 1, changes.end());
  changes.push_back(end);
  return changes;
}

CurveBreaks breaks_of(const FileRoad& road, const FileSection& section, int lane, double begin, double end,
                      double beyond_m) {
  CurveBreaks breaks{formula_changes(road, section, lane, begin, end), {}};
  if (has_banking(road)) return breaks;
  for (std::size_t i = 1; i < breaks.s.size(); ++i) {
    breaks.bend.push_back(bend_between(road, section, lane, beyond_m, breaks.s[i - 1], breaks.s[i]));
  }
  return breaks;
}

}  // namespace pictura::opendrive
