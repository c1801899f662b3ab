// Reads reference lines: <geometry> in plan, elevation and banking.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxCoordinate_m = 1e8, kMaxHeading_rad = 1e3;
constexpr double kMaxTurn_rad = 100.0;    // of one geometry: 16 turns, enough for a helix
constexpr double kMaxGap_m = 0.1;         // between two geometries of a reference line, and of its length
constexpr double kMaxLengthError = 0.01;  // relative error of a <paramPoly3>'s length, in addition to kMaxGap_m
// Larger errors up to these are mended; what is further off has no one meaning.
constexpr double kMaxMended_m = 0.5, kMaxMendedShare = 0.01;

/// Whether a length that is off by this much is mended.
bool can_mend(double error_m, double length_m) {
  return std::abs(error_m) <= std::max(kMaxMended_m, kMaxMendedShare * length_m);
}

std::array<double, 4> coefficients(const Element& element, const char* suffix) {
  std::array<double, 4> result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = element.number_in(fmt::format("{}{}", "abcd"[i], suffix).c_str(), -kMaxCoordinate_m, kMaxCoordinate_m);
  }
  return result;
}

/// v is a cubic of u; u ends where the arc length equals the length of the piece.
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
  cubic.p_end = range == "arcLength" ? length : 1.0;
  measure(&cubic);
  const double curve_m = cubic.arc_length.back();
  if (!(std::abs(curve_m - length) <= kMaxGap_m + kMaxLengthError * length)) {
    constexpr const char* kMessage = "its curve is {:.3f} m long; expected the geometry's length, {} m";
    if (!can_mend(curve_m - length, length)) element.fail(kMessage, curve_m, length);
    element.mend(MendKind::line_length, kMessage, curve_m, length);
  }
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
    element.fail("expected a <line>, <arc>, <spiral>, <poly3> or <paramPoly3> in it, found none");
  }
  const double turn = std::max(std::abs(piece.start_curvature), std::abs(piece.end_curvature)) * piece.length;
  if (!(turn <= kMaxTurn_rad)) element.fail("expected a curve of at most {} rad, got {}", kMaxTurn_rad, turn);
  measure(&piece);
  return piece;
}

/// Checks that a geometry begins at the s and position where the one before it ends.
void check_joint(const Element& element, const GeometryPiece& piece, GeometryPiece* before) {
  const double error_m = piece.s - (before->s + before->length);
  if (std::abs(error_m) > kStationTolerance_m) {
    constexpr const char* kMessage = "attribute s: expected {}, where the one before it ends, got {}";
    const double expected = before->s + before->length;
    if (!can_mend(error_m, before->length) || !(piece.s > before->s)) element.fail(kMessage, expected, piece.s);
    element.mend(MendKind::geometry_station, kMessage, expected, piece.s);
    before->length = piece.s - before->s;
    measure(before);
  }
  const Eigen::Vector2d end = pose_on(*before, before->length).position_m;
  const double gap_m = std::hypot(piece.x - end.x(), piece.y - end.y());
  if (gap_m > kMaxGap_m) {
    constexpr const char* kMessage =
        "begins {:.3f} m from the end of the one before it, at ({}, {}); expected at most {} m";
    if (!(gap_m <= kMaxMended_m)) element.fail(kMessage, gap_m, end.x(), end.y(), kMaxGap_m);
    element.mend(MendKind::geometry_gap, kMessage, gap_m, end.x(), end.y(), kMaxGap_m);
  }
}

/// Checks that the geometries join, and that together they are as long as the road.
void check_geometry(const std::vector<Element>& elements, FileRoad* road) {
  GeometryPiece& first = road->geometry.front();
  if (first.s > kStationTolerance_m) {
    constexpr const char* kMessage = "attribute s: expected 0 for the first one, got {}";
    if (!can_mend(first.s, first.length)) elements[0].fail(kMessage, first.s);
    elements[0].mend(MendKind::geometry_station, kMessage, first.s);
    first.s = 0;
  }
  for (std::size_t i = 1; i < elements.size(); ++i) {
    check_joint(elements[i], road->geometry[i], &road->geometry[i - 1]);
  }
  const GeometryPiece& last = road->geometry.back();
  const double end = last.s + last.length;
  if (std::abs(end - road->length) > kMaxGap_m) {
    constexpr const char* kMessage = "the reference line ends at {}; expected the road's length, {}";
    if (!can_mend(end - road->length, road->length)) elements.back().fail(kMessage, end, road->length);
    elements.back().mend(MendKind::line_length, kMessage, end, road->length);
    road->length = end;
  }
}

/// A straight road from where the first geometry begins.
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

/// Cubics of t at stations s: one cross-section per s.
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
      element.mend(MendKind::record_order, "attribute t: expected at least the previous one's {}, got {}",
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

/// Superelevation, crossfall (1.4) and shape. Profiles that are zero everywhere, as most are, are dropped.
void read_banking(const Element& lateral, FileRoad* road) {
  if (!lateral) return;
  if (const Element strips = lateral.child("crossSectionSurface")) {
    strips.fail("cross-sections as strips are not supported; expected <superelevation> or <shape>");
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

void read_reference_line(const Element& road_element, FileRoad* road) {
  const Element plan_view = road_element.required_child("planView");
  if (road->length < kMinRoadLength_m) {
    road_element.mend(MendKind::short_road, "attribute length: expected at least {}, got {}", kMinRoadLength_m,
                      road->length);
    road->length = kMinRoadLength_m;
    road->geometry.push_back(straight_piece(plan_view, road->length));
  } else {
    std::vector<Element> elements;
    plan_view.each("geometry", [&](const Element& element) {
      GeometryPiece piece = read_geometry(element);
      if (piece.length == 0) {
        return element.mend(MendKind::empty_geometry, "attribute length: expected more than 0");
      }
      elements.push_back(element);
      road->geometry.push_back(std::move(piece));
    });
    if (elements.empty()) plan_view.fail("expected a <geometry> with a length in it, found none");
    check_geometry(elements, road);
  }
  road->elevation = read_profile(road_element.child("elevationProfile"), "elevation", "s", road->length);
  read_banking(road_element.child("lateralProfile"), road);
}

}  // namespace pictura::opendrive
