// Lanes that a file gives as polylines: their points, their links, and the junctions where they cross. Shared by the
// importers of recorded scenes and of Lanelet2 maps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "pictura/common/grid.h"
#include "pictura/map/polyline.h"
#include "pictura/map/road_map.h"

namespace pictura {

inline const LanePoint& start_of(const RoadMap& map, int32_t lane) { return map.points_of(map.lanes[lane])[0]; }
inline const LanePoint& end_of(const RoadMap& map, int32_t lane) {
  const Span<const LanePoint> points = map.points_of(map.lanes[lane]);
  return points[points.size() - 1];
}

/// Appends the points (at least two, about the map's origin, none repeated) and sets the lane's range and length.
/// Headings at inner points are between the directions of the chords that meet there.
void append_lane_points(const std::vector<CurvePoint>& points, RoadMap* map, Lane* lane_out);

/// Pairs (lane, successor).
using LaneLinks = std::set<std::pair<int32_t, int32_t>>;

/// Sets the successors and predecessors of all lanes.
void set_lane_links(const LaneLinks& links, RoadMap* map);

/// Straight piece of a lane's center line.
struct LanePiece {
  Vec3 a_m, b_m;
  int32_t lane = 0;
};
/// Pieces of lanes in a grid, for searches of crossing and near lanes.
struct LanePieces {
  std::vector<LanePiece> segments;
  Grid grid;
};
using LanePredicate = bool (*)(const Lane&);
LanePieces segments_of(const RoadMap& map, LanePredicate is_wanted);

/// Returns the point where two segments, ends included, cross in plan at about the same height; nothing for parallel
/// segments.
std::optional<Vec2> crossing(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// Marks as junction lanes the wanted lanes of different roads that cross each other, except at their ends. Adds
/// junctions, and assigns to them these lanes and all lanes that are already marked. Lanes that cross, fork or merge
/// belong to one junction, which has the name of the first lane's road. If bridged_m > 0, for roads that are cut into
/// many lanes, junction lanes that follow each other belong to one junction too, as do wanted lanes of at most
/// bridged_m between two junction lanes. `count_work` receives the work of loops whose length a file determines.
void find_crossing_junctions(LanePredicate is_wanted, float bridged_m,
                             const std::function<void(std::size_t)>& count_work, RoadMap* map);

}  // namespace pictura
