// Painted lines and road edges as they are drawn. Lines that the importer cut at lane sections, mark records and roads
// are joined again. Duplicate lines of overlapping roads are removed, and so are road edges that painted lines cover.
// The RoadMap itself keeps every marking and its source.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Maximum distance between the painted lines and the map's markings, in either direction. It equals the importer's
/// default chord error, and a sixth of the usual width of a mark.
constexpr float kPaintTolerance_m = 0.02f;

struct PaintedLine {
  std::vector<Vec3> points_m;  // at least two; a ring repeats its first point at the end
  float width_m = 0;
  MarkColor color = MarkColor::white;
};

/// Returns the map's markings as they are drawn. Lines that other lines cover completely are removed. Lines that
/// continue each other with the same width and colour are joined. Points are removed if the line then moves by at most
/// kPaintTolerance_m. Ends of lines and dashes do not move.
std::vector<PaintedLine> painted_lines(const RoadMap& map);

/// Maximum width by which a covered road edge extends beyond the painted lines over it. Maps often paint a line along
/// the border of a road. The factor is 2, because the chords of the line and of the edge may both deviate from the
/// border.
constexpr float kCoveredEdgeTolerance_m = 2 * kPaintTolerance_m;

/// Returns the map's road edges except those that painted lines cover. `width_m` is the drawn width of an edge.
std::vector<RoadEdge> uncovered_edges(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m);

}  // namespace pictura
