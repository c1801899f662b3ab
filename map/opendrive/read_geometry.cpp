// Reads reference lines: <geometry> in plan, elevation and banking.
#include <algorithm>
#include <array>
#include <cmath>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxCoordinate_m = 1e8;
constexpr double kMaxTurn_rad = 100.0;    // of one geometry: 16 turns, enough for a helix
constexpr double kMaxGap_m = 0.1;         // between two geometries of a reference line
constexpr double kMaxLengthError = 0.01;  // relative error of a <paramPoly3>'s length, in addition to kMaxGap_m

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
    element.fail("its curve is {:.3f} m long; expected the geometry's length, {} m", curve_m, length);
  }
  return cubic;
}

GeometryPiece read_geometry(const Element& element) {
  GeometryPiece piece;
  piece.s = element.number_in("s", 0, kMaxRoadLength_m);
  piece.x = element.number_in("x", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.y = element.number_in("y", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.heading = element.number_in("hdg", -1e3, 1e3);
  piece.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (piece.length == 0) element.fail("attribute length: expected more than 0");
  if (element.child("line")) return piece;
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
    piece.start_curvature = spiral.number("curvStart");
    piece.end_curvature = spiral.number("curvEnd");
  } else {
    element.fail("expected a <line>, <arc>, <spiral>, <poly3> or <paramPoly3> in it, found none");
  }
  const double turn = std::max(std::abs(piece.start_curvature), std::abs(piece.end_curvature)) * piece.length;
  if (!(turn <= kMaxTurn_rad)) element.fail("expected a curve of at most {} rad, got {}", kMaxTurn_rad, turn);
  measure(&piece);
  return piece;
}

/// Checks that every geometry begins at the s and position where the previous one ends, and that together they are as
/// long as the road.
void check_geometry(const std::vector<Element>& elements, const FileRoad& road) {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const GeometryPiece& piece = road.geometry[i];
    if (i == 0) {
      if (piece.s > kStationTolerance_m) elements[i].fail("attribute s: expected 0 for the first one, got {}", piece.s);
      continue;
    }
    const GeometryPiece& before = road.geometry[i - 1];
    if (std::abs(piece.s - (before.s + before.length)) > kStationTolerance_m) {
      elements[i].fail("attribute s: expected {}, where the one before it ends, got {}", before.s + before.length,
                       piece.s);
    }
    const Eigen::Vector2d end = pose_on(before, before.length).position_m;
    const double gap_m = std::hypot(piece.x - end.x(), piece.y - end.y());
    if (gap_m > kMaxGap_m) {
      elements[i].fail("begins {:.3f} m from the end of the one before it, at ({}, {}); expected at most {} m", gap_m,
                       end.x(), end.y(), kMaxGap_m);
    }
  }
  const GeometryPiece& last = road.geometry.back();
  if (std::abs(last.s + last.length - road.length) > kMaxGap_m) {
    elements.back().fail("the reference line ends at {}; expected the road's length, {}", last.s + last.length,
                         road.length);
  }
}

bool is_zero(const Profile& profile) {
  return std::all_of(profile.cubics.begin(), profile.cubics.end(),
                     [](const Cubic& c) { return c.a == 0 && c.b == 0 && c.c == 0 && c.d == 0; });
}

/// Cubics of t at stations s: one cross-section per s.
std::vector<CrossSection> read_shape(const Element& lateral, double road_length) {
  std::vector<CrossSection> sections;
  lateral.each("shape", [&](const Element& element) {
    const double s = element.number_in("s", 0, road_length + kStationTolerance_m);
    if (!sections.empty() && s < sections.back().s) {
      element.fail("attribute s: expected at least the previous one's {}, got {}", sections.back().s, s);
    }
    if (sections.empty() || s > sections.back().s) sections.push_back({s, {}});
    Profile& height = sections.back().height;
    const Cubic cubic{.s = element.number_in("t", -kMaxOffset_m, kMaxOffset_m),
                      .a = element.number("a"),
                      .b = element.number("b"),
                      .c = element.number("c"),
                      .d = element.number("d")};
    if (!height.cubics.empty() && cubic.s < height.cubics.back().s) {
      element.fail("attribute t: expected at least the previous one's {}, got {}", height.cubics.back().s, cubic.s);
    }
    height.cubics.push_back(cubic);
  });
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
    const Cubic cubic = read_cubic(element, "s", road->length);
    if (side != "right") append_cubic(element, cubic, &road->left_crossfall);
    if (side != "left") append_cubic(element, cubic, &road->right_crossfall);
  });
  road->shape = read_shape(lateral, road->length);
  for (Profile* profile : {&road->superelevation, &road->left_crossfall, &road->right_crossfall}) {
    if (is_zero(*profile)) profile->cubics.clear();
  }
}

}  // namespace

void read_reference_line(const Element& road_element, FileRoad* road) {
  std::vector<Element> geometry;
  road_element.required_child("planView").each("geometry", [&](const Element& piece) {
    geometry.push_back(piece);
    road->geometry.push_back(read_geometry(piece));
  });
  if (geometry.empty()) road_element.child("planView").fail("expected a <geometry> in it, found none");
  check_geometry(geometry, *road);
  road->elevation = read_profile(road_element.child("elevationProfile"), "elevation", "s", road->length);
  read_banking(road_element.child("lateralProfile"), road);
}

}  // namespace pictura::opendrive
