// Painted lines and road edges as they are drawn: lines that the importer cut at lane sections, mark records and roads
// are joined again, duplicates from overlapping roads are removed, and so are road edges covered by paint. The RoadMap
// keeps every marking and its source.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Maximum distance between the painted lines and the map's markings, in either direction: as much as the importer's
/// chords deviate from the file's curves, and a sixth of the width of a usual mark.
constexpr float kPaintTolerance_m = 0.02f;

struct PaintedLine {
  std::vector<Vec3> points_m;  // at least two; a ring repeats its first point at the end
  float width_m = 0;
  MarkColor color = MarkColor::white;
};

/// The map's markings without lines that other lines cover completely, with lines of one width and colour that continue
/// each other joined, and with redundant points removed within kPaintTolerance_m. Ends of lines and dashes stay where
/// they are.
std::vector<PaintedLine> painted_lines(const RoadMap& map);

/// A road edge is not drawn if it extends beyond the painted lines over it by at most this: maps paint a line along the
/// border of a road, and the chords of both may deviate from it.
constexpr float kCoveredEdgeTolerance_m = 2 * kPaintTolerance_m;

/// The map's road edges, drawn `width_m` wide, without those covered by painted lines.
std::vector<RoadEdge> uncovered_edges(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m);

}  // namespace pictura
