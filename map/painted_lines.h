// Painted lines as they are drawn: what the importer cut at lane sections, mark records and roads is one line again,
// and paint that several roads bring is there once. The RoadMap keeps every marking and where it came from.
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

}  // namespace pictura
