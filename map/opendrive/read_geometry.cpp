// Reference lines: <geometry> in plan, heights along it.
#include <algorithm>
#include <cmath>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxCoordinate_m = 1e8;
constexpr double kMaxTurn_rad = 100.0;  // of one geometry: 16 turns of a helix are enough
constexpr double kMaxGap_m = 0.1;       // between two geometries of a reference line

GeometryPiece read_geometry(const Element& element) {
  GeometryPiece piece;
  piece.s = element.number_in("s", 0, kMaxRoadLength_m);
  piece.x = element.number_in("x", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.y = element.number_in("y", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.heading = element.number_in("hdg", -1e3, 1e3);
  piece.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (piece.length == 0) element.fail("attribute length: expected more than 0");
  if (element.child("line")) return piece;
  if (const Element arc = element.child("arc")) {
    piece.start_curvature = piece.end_curvature = arc.number("curvature");
  } else if (const Element spiral = element.child("spiral")) {
    piece.start_curvature = spiral.number("curvStart");
    piece.end_curvature = spiral.number("curvEnd");
  } else {
    for (const char* other : {"poly3", "paramPoly3"}) {
      if (element.child(other)) element.fail("<{}> is not supported; expected <line>, <arc> or <spiral>", other);
    }
    element.fail("expected a <line>, <arc> or <spiral> in it, found none");
  }
  const double turn = std::max(std::abs(piece.start_curvature), std::abs(piece.end_curvature)) * piece.length;
  if (!(turn <= kMaxTurn_rad)) element.fail("expected a curve of at most {} rad, got {}", kMaxTurn_rad, turn);
  return piece;
}

/// Every geometry begins where and when the one before it ends, and together they are as long as the road.
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
    const Pose end = pose_on(before, before.length);
    const double gap_m = std::hypot(piece.x - end.x, piece.y - end.y);
    if (gap_m > kMaxGap_m) {
      elements[i].fail("begins {:.3f} m from the end of the one before it, at ({}, {}); expected at most {} m", gap_m,
                       end.x, end.y, kMaxGap_m);
    }
  }
  const GeometryPiece& last = road.geometry.back();
  if (std::abs(last.s + last.length - road.length) > kMaxGap_m) {
    elements.back().fail("the reference line ends at {}; expected the road's length, {}", last.s + last.length,
                         road.length);
  }
}

void refuse_superelevation(const Element& road_element) {
  const Element lateral = road_element.child("lateralProfile");
  if (!lateral) return;
  for (const char* name : {"superelevation", "shape"}) {
    lateral.each(name, [&](const Element& element) {
      for (const char* coefficient : {"a", "b", "c", "d"}) {
        if (std::abs(element.number(coefficient, 0)) > 1e-9) element.fail("banked roads are not supported");
      }
    });
  }
}

}  // namespace

void read_reference_line(const Element& road_element, FileRoad* road) {
  std::vector<Element> geometry;
  road_element.needed_child("planView").each("geometry", [&](const Element& piece) {
    geometry.push_back(piece);
    road->geometry.push_back(read_geometry(piece));
  });
  if (geometry.empty()) road_element.child("planView").fail("expected a <geometry> in it, found none");
  check_geometry(geometry, *road);
  road->elevation = read_profile(road_element.child("elevationProfile"), "elevation", "s", road->length);
  refuse_superelevation(road_element);
}

}  // namespace pictura::opendrive
