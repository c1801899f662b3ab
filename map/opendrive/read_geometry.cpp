// Reads reference lines: <geometry> in plan, elevation and banking.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/read_parts.h"
#include "pictura/map/opendrive/spread_jumps.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxCoordinate_m = 1e8, kMaxHeading_rad = 1e3;
constexpr double kMaxTurn_rad = 100.0;  // maximum turn of a geometry: 16 full turns, enough for a helix
constexpr double kMaxGap_m = 0.1;  // maximum gap between two geometries, and maximum error of a reference line's length
constexpr double kMaxLengthError = 0.01;  // relative error of a <paramPoly3>'s length, in addition to kMaxGap_m
constexpr double kMaxJump_m = 5.0;        // maximum jump that is repaired; larger jumps have no sensible meaning
constexpr double kMaxStep_m = 0.5;        // maximum step of the elevation; a larger step would be a wall for cars
constexpr std::size_t kMaxJumps = 1000;   // maximum number of jumps per road; bounds the time of smoothing
// Maximum turn at a geometry that is shorter than kStationTolerance_m. If the turn is larger, the heading of the
// geometry has no meaning.
constexpr double kMaxKink_rad = 0.2;
// Maximum error of a length, in metres or as a share of the length, that is repaired by cutting or extending.
constexpr double kMaxCut_m = 0.5, kMaxCutShare = 0.01;

bool can_cut(double error_m, double length_m) {
  return std::abs(error_m) <= std::max(kMaxCut_m, kMaxCutShare * length_m);
}

/// A <geometry> and its parsed contents.
struct Geometry {
  double s = 0;  // station in the file
  Element element;
  GeometryPiece piece;
};

std::array<double, 4> coefficients(const Element& element, const char* suffix) {
  std::array<double, 4> result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] =
        element.number_or_zero_in(fmt::format("{}{}", "abcd"[i], suffix).c_str(), -kMaxCoordinate_m, kMaxCoordinate_m);
  }
  return result;
}

/// Reads a cubic v(u). u ends where the arc length equals the length of the piece.
PlaneCubic read_poly3(const Element& element, double length) {
  PlaneCubic cubic{.u = {0, 1, 0, 0}, .v = coefficients(element, "")};
  double low = 0, high = length;
  for (int iteration = 0; iteration < 60; ++iteration) {
    cubic.p_end = 0.5 * (low + high);
    measure(&cubic);
    (cubic.arc_length.back() < length ? low : high) = cubic.p_end;
  }
  return cubic;
}

PlaneCubic read_param_poly3(const Element& element, double length) {
  PlaneCubic cubic{.u = coefficients(element, "U"), .v = coefficients(element, "V")};
  const std::string range = element.text("pRange", "normalized");
  if (range != "normalized" && range != "arcLength") {
    element.fail("attribute pRange: expected normalized or arcLength, got '{}'", range);
  }
  const auto measure_to = [&](double p_end) {
    cubic.p_end = p_end;
    measure(&cubic);
    return cubic.arc_length.back();
  };
  const auto fits = [&](double curve_m) { return std::abs(curve_m - length) <= kMaxGap_m + kMaxLengthError * length; };
  const double stated = range == "arcLength" ? length : 1.0, other = range == "arcLength" ? 1.0 : length;
  const double curve_m = measure_to(stated);
  if (fits(curve_m)) return cubic;
  constexpr const char* kMessage = "its curve is {:.3f} m long; expected the geometry's length, {} m";
  if (fits(measure_to(other))) {
    element.record_repair(RepairKind::parameter_range, kMessage, curve_m, length);
    return cubic;
  }
  if (!(curve_m >= kMinRoadLength_m && curve_m <= kMaxRoadLength_m)) element.fail(kMessage, curve_m, length);
  element.record_repair(RepairKind::line_length, kMessage, curve_m, length);
  measure_to(stated);
  return cubic;
}

GeometryPiece read_geometry(const Element& element) {
  GeometryPiece piece;
  piece.s = element.number_in("s", 0, kMaxRoadLength_m);
  piece.x = element.number_in("x", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.y = element.number_in("y", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.heading = element.number_in("hdg", -kMaxHeading_rad, kMaxHeading_rad);
  piece.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (piece.length == 0 || element.child("line")) return piece;
  if (const Element poly3 = element.child("poly3")) {
    piece.cubic = read_poly3(poly3, piece.length);
    return piece;
  }
  if (const Element poly3 = element.child("paramPoly3")) {
    piece.cubic = read_param_poly3(poly3, piece.length);
    return piece;
  }
  if (const Element arc = element.child("arc")) {
    piece.start_curvature = piece.end_curvature = arc.number("curvature");
  } else if (const Element spiral = element.child("spiral")) {
    piece.start_curvature = spiral.number_or_zero("curvStart");
    piece.end_curvature = spiral.number_or_zero("curvEnd");
  } else {
    element.fail("expected a <line>, <arc>, <spiral>, <poly3> or <paramPoly3> inside, found none");
  }
  const double turn = std::max(std::abs(piece.start_curvature), std::abs(piece.end_curvature)) * piece.length;
  if (!(turn <= kMaxTurn_rad)) element.fail("expected a curve of at most {} rad, got {}", kMaxTurn_rad, turn);
  measure(&piece);
  return piece;
}

double distance_m(const GeometryPiece& before, const GeometryPiece& piece) {
  return (Eigen::Vector2d{piece.x, piece.y} - pose_on(before, before.length).position_m).norm();
}

/// Makes a geometry begin at the station where the previous geometry ends. Cuts or extends the previous geometry if the
/// error is small, or if this does not increase the gap between the two geometries. Otherwise moves the geometry along
/// s. Returns the distance of the move.
double join_stations(const Geometry& geometry, GeometryPiece* before, GeometryPiece* piece) {
  const double end = before->s + before->length, error = piece->s - end;
  if (std::abs(error) <= kStationTolerance_m) return 0;
  // Messages state the stations of the file, before earlier moves.
  const double stated = geometry.piece.s, stated_end = end - (piece->s - stated);
  constexpr const char* kMessage = "attribute s: expected {}, where the previous geometry ends, got {}";
  if (piece->s > before->s) {
    GeometryPiece cut = *before;
    cut.length = piece->s - before->s;
    measure(&cut);
    if (can_cut(error, before->length) ||
        distance_m(cut, *piece) <= distance_m(*before, *piece) + kStationTolerance_m) {
      geometry.element.record_repair(RepairKind::geometry_station, kMessage, stated_end, stated);
      *before = std::move(cut);
      return 0;
    }
  }
  geometry.element.record_repair(RepairKind::moved_geometry, kMessage, stated_end, stated);
  piece->s = end;
  return -error;
}

/// Returns the jump if a geometry does not begin at the end of the previous one.
std::optional<Jump> jump_between(const Geometry& geometry, std::size_t index, const FileRoad& road) {
  const GeometryPiece& before = road.geometry[index - 1];
  const double gap_m = distance_m(before, road.geometry[index]);
  if (gap_m <= kMaxGap_m) return std::nullopt;
  const Eigen::Vector2d end = pose_on(before, before.length).position_m;
  constexpr const char* kMessage =
      "begins {:.3f} m from the end of the previous geometry, at ({}, {}); expected at most {} m";
  const bool can_spread = can_spread_jump(gap_m, road.length);
  if (!(gap_m <= (can_spread ? kMaxJump_m : kMaxCut_m))) {
    geometry.element.fail(kMessage, gap_m, end.x(), end.y(), kMaxGap_m);
  }
  geometry.element.record_repair(can_spread ? RepairKind::geometry_jump : RepairKind::geometry_gap, kMessage, gap_m,
                                 end.x(), end.y(), kMaxGap_m);
  if (!can_spread) return std::nullopt;
  return Jump{.piece = index, .shift_m = Eigen::Vector2d{road.geometry[index].x, road.geometry[index].y} - end};
}

/// Angle between the end of a geometry and the start of the next one.
double turn_between(const GeometryPiece& piece, const GeometryPiece& next) {
  return std::abs(std::remainder(next.heading - pose_on(piece, piece.length).heading, 2 * std::numbers::pi));
}

/// Drops geometries of nearly no length whose heading differs from that of the next geometry. The last geometry is
/// compared with the previous one.
void drop_kinks(std::vector<Geometry>* geometries) {
  std::vector<Geometry> kept;
  for (std::size_t i = 0; i < geometries->size(); ++i) {
    const Geometry& geometry = (*geometries)[i];
    double turn_rad = 0;
    if (i + 1 < geometries->size()) {
      turn_rad = turn_between(geometry.piece, (*geometries)[i + 1].piece);
    } else if (!kept.empty()) {
      turn_rad = turn_between(kept.back().piece, geometry.piece);
    }
    if (geometry.piece.length >= kStationTolerance_m || turn_rad <= kMaxKink_rad) {
      kept.push_back(geometry);
      continue;
    }
    geometry.element.record_repair(RepairKind::empty_geometry,
                                   "attribute length: expected at least {} where the line turns by {:.3f} rad, got {}",
                                   kStationTolerance_m, turn_rad, geometry.piece.length);
  }
  *geometries = std::move(kept);
}

/// Joins the geometries into the reference line. Its length becomes the road's length, even if the file gives another
/// length.
void join_geometry(const std::vector<Geometry>& geometries, FileRoad* road) {
  double moved = 0;  // sum of the moves along s
  for (const Geometry& geometry : geometries) {
    GeometryPiece piece = geometry.piece;
    piece.s += moved;
    if (!road->geometry.empty()) {
      moved += join_stations(geometry, &road->geometry.back(), &piece);
    } else if (piece.s > kStationTolerance_m) {
      const bool is_near = can_cut(piece.s, piece.length);
      geometry.element.record_repair(is_near ? RepairKind::geometry_station : RepairKind::moved_geometry,
                                     "attribute s: expected 0 for the first geometry, got {}", piece.s);
      if (!is_near) moved = -piece.s;
      piece.s = 0;
    }
    road->geometry.push_back(std::move(piece));
  }
  const GeometryPiece& last = road->geometry.back();
  const double end = last.s + last.length;
  if (std::abs(end - road->length) > kMaxGap_m) {
    constexpr const char* kMessage = "the reference line ends at {}; expected the road's length, {}";
    if (!(end <= kMaxRoadLength_m)) geometries.back().element.fail(kMessage, end, road->length);
    geometries.back().element.record_repair(RepairKind::line_length, kMessage, end, road->length);
    road->length = end;
  }
  std::vector<Jump> jumps;
  for (std::size_t i = 1; i < geometries.size(); ++i) {
    if (const std::optional<Jump> jump = jump_between(geometries[i], i, *road)) jumps.push_back(*jump);
    if (jumps.size() > kMaxJumps) geometries[i].element.fail("expected at most {} gaps in a road", kMaxJumps);
  }
  if (!jumps.empty()) spread_jumps(jumps, road);
}

/// Reads the elevation, and smooths jumps between its cubics. Jumps beyond `described`, where the file's description of
/// the road ends, are ignored.
void read_elevation(const Element& profile, double described, FileRoad* road) {
  road->elevation = read_profile(profile, "elevation", "s", road->length);
  const std::vector<Cubic>& cubics = road->elevation.cubics;
  std::vector<HeightJump> jumps;
  for (std::size_t i = 1; i < cubics.size(); ++i) {
    const double s = cubics[i].s, before_m = Profile{{cubics[i - 1]}}.value(s), rise_m = cubics[i].a - before_m;
    if (std::abs(rise_m) <= kMaxStep_m || s >= std::min(described, road->length)) continue;
    profile.record_repair(RepairKind::height_jump,
                          "at s {} it jumps by {:.3f} m from {:.3f} m; expected a jump of at most {} m", s, rise_m,
                          before_m, kMaxStep_m);
    jumps.push_back({s, rise_m});
    if (jumps.size() > kMaxJumps) profile.fail("expected at most {} jumps in a road", kMaxJumps);
  }
  if (!jumps.empty()) spread_height_jumps(jumps, road);
}

/// Returns a straight line of this length from the start of the first geometry.
GeometryPiece straight_piece(const Element& plan_view, double length) {
  GeometryPiece piece = {};
  const Element first = plan_view.required_child("geometry");
  piece.x = first.number_in("x", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.y = first.number_in("y", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.heading = first.number_in("hdg", -kMaxHeading_rad, kMaxHeading_rad);
  piece.length = length;
  return piece;
}

bool is_zero(const Profile& profile) {
  return std::all_of(profile.cubics.begin(), profile.cubics.end(),
                     [](const Cubic& c) { return c.a == 0 && c.b == 0 && c.c == 0 && c.d == 0; });
}

/// Reads the cross-sections. The cubics of t with the same station s make one cross-section.
std::vector<CrossSection> read_shape(const Element& lateral, double road_length) {
  struct Shape {
    double s = 0;
    Cubic height;
  };
  std::vector<Shape> shapes;
  lateral.each("shape", [&](const Element& element) {
    const std::optional<double> s = read_station(element, "s", road_length);
    if (!s) return;
    const double t = element.number_in("t", -kMaxOffset_m, kMaxOffset_m);
    if (!shapes.empty() && *s == shapes.back().s && t < shapes.back().height.s) {
      element.record_repair(RepairKind::record_order, "attribute t: expected at least the previous one's {}, got {}",
                            shapes.back().height.s, t);
    }
    append_record(element, "s", &Shape::s, {*s, read_cubic(element, t)}, &shapes);
  });
  sort_records(&Shape::s, &shapes);
  std::vector<CrossSection> sections;
  for (const Shape& shape : shapes) {
    if (sections.empty() || shape.s > sections.back().s) sections.push_back({shape.s, {}});
    sections.back().height.cubics.push_back(shape.height);
  }
  for (CrossSection& section : sections) sort_records(&Cubic::s, &section.height.cubics);
  if (std::all_of(sections.begin(), sections.end(), [](const CrossSection& c) { return is_zero(c.height); })) {
    sections.clear();
  }
  return sections;
}

/// Reads superelevation, crossfall (of OpenDRIVE 1.4) and shape. Drops profiles that are zero everywhere, which most
/// are.
void read_banking(const Element& lateral, FileRoad* road) {
  if (!lateral) return;
  if (const Element strips = lateral.child("crossSectionSurface")) {
    strips.record_repair(RepairKind::strip_surface,
                         "cross-sections as strips are not supported; expected <superelevation> or <shape>");
  }
  road->superelevation = read_profile(lateral, "superelevation", "s", road->length);
  lateral.each("crossfall", [&](const Element& element) {
    const std::string side = element.text("side", "both");
    if (side != "left" && side != "right" && side != "both") {
      element.fail("attribute side: expected left, right or both, got '{}'", side);
    }
    const std::optional<double> s = read_station(element, "s", road->length);
    if (!s) return;
    const Cubic cubic = read_cubic(element, *s);
    if (side != "right") append_record(element, "s", &Cubic::s, cubic, &road->left_crossfall.cubics);
    if (side == "right") append_record(element, "s", &Cubic::s, cubic, &road->right_crossfall.cubics);
    if (side == "both") road->right_crossfall.cubics.push_back(cubic);
  });
  for (Profile* fall : {&road->left_crossfall, &road->right_crossfall}) sort_records(&Cubic::s, &fall->cubics);
  road->shape = read_shape(lateral, road->length);
  for (Profile* profile : {&road->superelevation, &road->left_crossfall, &road->right_crossfall}) {
    if (is_zero(*profile)) profile->cubics.clear();
  }
}

}  // namespace

double read_reference_line(const Element& road_element, FileRoad* road) {
  const Element plan_view = road_element.required_child("planView");
  const double stated = road->length;
  double drawn = 0;
  plan_view.each("geometry",
                 [&](const Element& element) { drawn += element.number_in("length", 0, kMaxRoadLength_m); });
  const bool is_short = drawn < kMinRoadLength_m;
  if (is_short) {
    road_element.record_repair(RepairKind::short_road, "attribute length: expected at least {} with <geometry>, got {}",
                               kMinRoadLength_m, drawn);
    road->length = kMinRoadLength_m;
    road->geometry.push_back(straight_piece(plan_view, road->length));
  } else {
    std::vector<Geometry> geometries;
    plan_view.each("geometry", [&](const Element& element) {
      GeometryPiece piece = read_geometry(element);
      if (piece.length == 0) {
        return element.record_repair(RepairKind::empty_geometry, "attribute length: expected more than 0");
      }
      const double s = piece.s;
      append_record(element, "s", &Geometry::s, {s, element, std::move(piece)}, &geometries);
    });
    sort_records(&Geometry::s, &geometries);
    drop_kinks(&geometries);
    join_geometry(geometries, road);
  }
  const double described = is_short ? 0 : stated;
  read_elevation(road_element.child("elevationProfile"), described, road);
  read_banking(road_element.child("lateralProfile"), road);
  return described;
}

}  // namespace pictura::opendrive
