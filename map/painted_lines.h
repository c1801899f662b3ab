// Painted lines and road edges as they are drawn: what the importer cut at lane sections, mark records and roads is one
// line again, paint that several roads bring is there once, and so is what paint lies over. The RoadMap keeps every
// marking and where it came from.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// No place of a painted line lies further than this from the map's markings, and none of theirs further from it: as
/// far as the importer's chords may stray from the file's curves, and a sixth of the width of a usual mark.
constexpr float kPaintTolerance_m = 0.02f;

struct PaintedLine {
  std::vector<Vec3> points_m;  // at least two; a ring ends where it begins
  float width_m = 0;
  MarkColor color = MarkColor::white;
};

/// The map's markings with every line that others paint too left out, lines of one width and colour that continue each
/// other joined, and points left out that kPaintTolerance_m can spare. Ends of lines and dashes stay where they are.
std::vector<PaintedLine> painted_lines(const RoadMap& map);

/// A road edge that nowhere sticks out by more than this from beneath the lines is not seen: maps paint a line along
/// the border of a road, and the chords of both may stray from it.
constexpr float kHiddenEdge_m = 2 * kPaintTolerance_m;

/// The map's road edges, of that width, without those that painted lines lie over.
std::vector<RoadEdge> edges_beside(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m);

}  // namespace pictura
