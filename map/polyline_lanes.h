// Lanes from files that store them as polylines: their points, their links, and the junctions where they cross. Shared
// by the importers of recorded scenes and of Lanelet2 maps.
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

/// Appends a lane's points to the map, and sets the lane's range and length. The points are relative to the map's
/// origin. There must be at least two, and none may equal the point before it. The heading at an inner point is midway
/// between the directions of the chords before and after it.
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
/// Pieces of lanes in a grid, for searches for crossing or near lanes.
struct LanePieces {
  std::vector<LanePiece> segments;
  Grid grid;
};
using LanePredicate = bool (*)(const Lane&);
LanePieces segments_of(const RoadMap& map, LanePredicate is_wanted);

/// Returns the point where the segments a-b and c-d, ends included, cross in plan. Returns nothing if they do not
/// cross, are parallel, or differ there in height by kSameRoadLevel_m or more.
std::optional<Vec2> crossing(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// Finds junctions. Lanes of different roads become junction lanes if is_wanted accepts them and they cross anywhere
/// except at their ends. All junction lanes, including those marked before the call, are assigned to new junctions.
/// Lanes that cross, fork or merge belong to one junction, which has the name of the first lane's road. If bridged_m is
/// positive (for roads that are cut into many lanes), there are two more rules: a wanted lane of at most bridged_m
/// between two junction lanes also becomes a junction lane; and junction lanes that follow each other belong to one
/// junction. Calls count_work(steps) as it goes, so that the caller can limit the work that a file causes.
void find_crossing_junctions(LanePredicate is_wanted, float bridged_m,
                             const std::function<void(std::size_t)>& count_work, RoadMap* map);

}  // namespace pictura
