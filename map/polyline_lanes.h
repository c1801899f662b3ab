// Lanes from files that store them as polylines.
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

/// Appends a lane's points to the map, and sets the lane's range and length. At least two points, relative to the map's
/// origin and without repetitions, are required. The heading at an inner point is midway between those of its chords.
void append_lane_points(const std::vector<CurvePoint>& points, RoadMap* map, Lane* lane_out);

/// Pairs (lane, successor).
using LaneLinks = std::set<std::pair<int32_t, int32_t>>;

void set_lane_links(const LaneLinks& links, RoadMap* map);

/// Straight piece of a lane's centre line.
struct LanePiece {
  Vec3 a_m, b_m;
  int32_t lane = 0;
};
struct LanePieces {
  std::vector<LanePiece> segments;
  Grid grid;
};
using LanePredicate = bool (*)(const Lane&);
LanePieces segments_of(const RoadMap& map, LanePredicate is_wanted);

/// Returns the crossing of the segments a-b and c-d in plan, ends included. Returns nothing for parallel segments, or
/// if their heights there differ by kSameRoadLevel_m or more.
std::optional<Vec2> crossing(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// Finds junctions. Lanes of different roads for which is_wanted() is true become junction lanes if they cross at a
/// point that is an end of neither. All junction lanes, including those marked before, get new junctions. Lanes that
/// cross, fork or merge share a junction, named after the first lane's road. A positive bridged_m is for roads that are
/// cut into many lanes. Successive junction lanes then share a junction. A wanted lane between junction lanes then
/// joins their junction if it is at most bridged_m long. Calls count_work(steps), so that the caller can limit the
/// work.
void find_crossing_junctions(LanePredicate is_wanted, float bridged_m,
                             const std::function<void(std::size_t)>& count_work, RoadMap* map);

}  // namespace pictura
