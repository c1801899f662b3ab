#include "pictura/map/opendrive/curves.h"

#include <algorithm>
#include <cmath>

namespace pictura::opendrive {

namespace {

// Below this a width is taken for 0: what writers' rounding leaves of a lane that tapers off.
constexpr double kWidthTolerance_m = 0.01;
// Formulae that begin this close to a section's ends belong to its neighbour or to itself, whichever begins there.
constexpr double kSectionMargin_m = 1e-5;
constexpr double kMaxOffset_m = 1e4, kMaxHeight_m = 1e4;
// Spirals are integrated in panels that turn by at most this; five points are then exact to rounding.
constexpr double kPanelTurn_rad = 0.5;

struct GaussPoint {
  double position, weight;  // on [0, 1]
};
constexpr GaussPoint kGauss[5] = {{0.046910077030668004, 0.11846344252809454},
                                  {0.23076534494715845, 0.23931433524968324},
                                  {0.5, 0.28444444444444444},
                                  {0.76923465505284155, 0.23931433524968324},
                                  {0.95308992296933200, 0.11846344252809454}};

/// The last element of `items` whose s is at most `s`, or the first one.
template <typename Item>
const Item& item_at(const std::vector<Item>& items, double s) {
  const auto after =
      std::upper_bound(items.begin(), items.end(), s, [](double x, const Item& item) { return x < item.s; });
  return after == items.begin() ? items.front() : *(after - 1);
}

/// `s` moved just inside the section: offsets and widths step where sections meet, and each section wants its own side.
double inside(const FileSection& section, double s) {
  const double margin = std::min(kSectionMargin_m, 0.5 * (section.end - section.s));
  return std::clamp(s, section.s + margin, section.end - margin);
}

/// sin(x) / x.
double sinc(double x) { return std::abs(x) < 1e-6 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

}  // namespace

double Profile::value(double s) const {
  if (cubics.empty() || s < cubics.front().s - 1e-6) return 0;
  const Cubic& cubic = item_at(cubics, s);
  const double ds = s - cubic.s;
  return cubic.a + ds * (cubic.b + ds * (cubic.c + ds * cubic.d));
}

double Profile::slope(double s) const {
  if (cubics.empty() || s < cubics.front().s - 1e-6) return 0;
  const Cubic& cubic = item_at(cubics, s);
  const double ds = s - cubic.s;
  return cubic.b + ds * (2 * cubic.c + ds * 3 * cubic.d);
}

Pose pose_on(const GeometryPiece& piece, double ds) {
  const double k0 = piece.start_curvature;
  const double rate = (piece.end_curvature - k0) / piece.length;
  auto heading_at = [&](double x) { return piece.heading + x * (k0 + 0.5 * rate * x); };
  if (rate == 0) {
    // The chord of an arc points along its middle heading.
    const double half_turn = 0.5 * k0 * ds;
    const double chord = ds * sinc(half_turn);
    return {piece.x + chord * std::cos(piece.heading + half_turn),
            piece.y + chord * std::sin(piece.heading + half_turn), piece.heading + k0 * ds};
  }
  const double turn = std::max(std::abs(k0), std::abs(piece.end_curvature)) * std::abs(ds);
  const int panels = 1 + static_cast<int>(turn / kPanelTurn_rad);
  const double panel = ds / panels;
  double x = 0, y = 0;
  for (int i = 0; i < panels; ++i) {
    for (const GaussPoint& gauss : kGauss) {
      const double heading = heading_at((i + gauss.position) * panel);
      x += gauss.weight * std::cos(heading);
      y += gauss.weight * std::sin(heading);
    }
  }
  return {piece.x + x * panel, piece.y + y * panel, heading_at(ds), k0 + rate * ds};
}

Pose pose_at(const FileRoad& road, double s) {
  const GeometryPiece& piece = item_at(road.geometry, s);
  return pose_on(piece, std::clamp(s - piece.s, 0.0, piece.length));
}

Point3 point_at(const FileRoad& road, double s, double t) {
  const Pose pose = pose_at(road, s);
  const double z = road.elevation.value(s);
  if (!(std::abs(t) <= kMaxOffset_m && std::abs(z) <= kMaxHeight_m)) {
    road.where.fail("at s {:.3f} something lies {} m beside it at a height of {} m; expected at most {} and {} m", s, t,
                    z, kMaxOffset_m, kMaxHeight_m);
  }
  return {pose.x - t * std::sin(pose.heading), pose.y + t * std::cos(pose.heading), z};
}

double lane_width(const FileSection& section, const FileLane& lane, double s) {
  const double width = lane.width.value(inside(section, s) - section.s);
  if (width < -kWidthTolerance_m) lane.where.fail("its width at s {:.3f} is {:.3f} m; expected at least 0", s, width);
  return std::max(width, 0.0);
}

double border_t(const FileRoad& road, const FileSection& section, int border, double s) {
  double t = road.lane_offset.value(inside(section, s));
  for (int i = 0; i < border; ++i) t += lane_width(section, section.left[static_cast<std::size_t>(i)], s);
  for (int i = 0; i < -border; ++i) t -= lane_width(section, section.right[static_cast<std::size_t>(i)], s);
  return t;
}

double border_slope(const FileRoad& road, const FileSection& section, int border, double s) {
  const double here = inside(section, s);
  double slope = road.lane_offset.slope(here);
  for (int i = 0; i < border; ++i) slope += section.left[static_cast<std::size_t>(i)].width.slope(here - section.s);
  for (int i = 0; i < -border; ++i) slope -= section.right[static_cast<std::size_t>(i)].width.slope(here - section.s);
  return slope;
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
  add_all(road.elevation.cubics, 0);
  add_all(road.lane_offset.cubics, 0);
  const std::vector<FileLane>& side = border > 0 ? section.left : section.right;
  for (int i = 0; i < std::abs(border); ++i) add_all(side[static_cast<std::size_t>(i)].width.cubics, section.s);
  std::sort(changes.begin() + 1, changes.end());
  changes.push_back(end);
  return changes;
}

}  // namespace pictura::opendrive
