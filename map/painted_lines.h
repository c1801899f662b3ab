// Painted lines and road edges as they are drawn. The RoadMap itself keeps every marking.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Maximum distance between painted lines and markings, in either direction: the importer's default chord error.
constexpr float kPaintTolerance_m = 0.02f;

struct PaintedLine {
  std::vector<Vec3> points_m;  // at least two; a ring repeats its first point
  float width_m = 0;
  MarkColor color = MarkColor::white;
};

/// Returns the markings, except lines that other lines cover along their whole length. Lines that continue each other
/// with equal width and colour are joined. Points are removed if the line then moves by at most kPaintTolerance_m. Ends
/// of lines and dashes stay.
std::vector<PaintedLine> painted_lines(const RoadMap& map);

/// Maximum width by which a covered road edge extends beyond painted lines. The factor is 2
/// because the chords of both may deviate from the true border.
constexpr float kCoveredEdgeTolerance_m = 2 * kPaintTolerance_m;

/// Returns the map's road edges except those that `lines` cover. `width_m` is the drawn width of an edge.
std::vector<RoadEdge> uncovered_edges(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m);

}  // namespace pictura
