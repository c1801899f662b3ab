// Painted lines and road edges as they are drawn. Lines that the importer cut at lane sections, mark records and roads
// are joined again. Duplicates from overlapping roads and road edges covered by paint are removed. The RoadMap keeps
// every marking and its source.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Maximum distance between the painted lines and the map's markings, in either direction: the deviation of the
/// importer's chords from the file's curves, and a sixth of the width of a usual mark.
constexpr float kPaintTolerance_m = 0.02f;

struct PaintedLine {
  std::vector<Vec3> points_m;  // at least two; a ring repeats its first point at the end
  float width_m = 0;
  MarkColor color = MarkColor::white;
};

/// Returns the map's markings as they are drawn: lines that other lines cover completely are removed, continuing lines
/// of one width and colour are joined, and redundant points are removed within kPaintTolerance_m. Ends of lines and
/// dashes do not move.
std::vector<PaintedLine> painted_lines(const RoadMap& map);

/// Maximum width by which a road edge that is not drawn extends beyond the painted lines over it. Maps paint a line
/// along the border of a road, and the chords of both may deviate from the border.
constexpr float kCoveredEdgeTolerance_m = 2 * kPaintTolerance_m;

/// Returns the map's road edges, drawn `width_m` wide, except those covered by painted lines.
std::vector<RoadEdge> uncovered_edges(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m);

}  // namespace pictura
