#include "pictura/simulator/map_rules.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/endless_lanes.h"
#include "pictura/map/open_lanes.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/exit.h"
#include "pictura/simulator/rules/limits.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/road.h"
#include "pictura/simulator/rules/signal.h"

namespace pictura {
namespace {

/// Maximum distance of observed pieces from curves. It is large, so that junctions do not fill the observation with
/// short pieces.
constexpr float kObservedChordError_m = 0.25f;
constexpr float kNearCell_m = 10.0f;
constexpr float kCellRadius_m = 0.5f * 1.41421356f * kNearCell_m + 0.1f;  // half a diagonal, plus a margin for rounding
constexpr float kLookupCell_m = 5.0f;
/// Distance between the end of routes and the end of lanes on open maps.
constexpr float kRouteEndMargin_m = 5.0f;
/// Lists of observable items are made only for cells within this distance of drivable lanes, because agents are not
/// farther away.
constexpr float kObserverReach_m = 15.0f;

Aabb2 box_of_segment(Vec2 a, Vec2 b, float reach_m) {
  return {{std::min(a.x, b.x) - reach_m, std::min(a.y, b.y) - reach_m},
          {std::max(a.x, b.x) + reach_m, std::max(a.y, b.y) + reach_m}};
}

float distance_to_segment(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 way = b - a;
  const float way2 = dot(way, way);
  const float t = way2 > 0 ? std::clamp(dot(p - a, way) / way2, 0.0f, 1.0f) : 0.0f;
  return length(p - a - way * t);
}

/// Rules for cutting observed pieces out of polylines.
struct PieceRule {
  float chord_error_m;  // points within this distance of a piece are omitted
  float longest_m;      // maximum length of a piece
  bool joins_all;       // whether straight parts are cut evenly; otherwise pieces end at points
};

PieceRule piece_rule(float observed_span_m) {
  constexpr float kStraight_m = 0.02f;
  if (observed_span_m > 0) return {kStraight_m, observed_span_m, true};
  return {kObservedChordError_m, kMaxPiece_m, false};
}

/// Cuts a polyline into observed pieces. For `extent` see ObservedPiece.
void append_pieces(const std::vector<Vec3>& points, float extent, const PieceRule& rule,
                   std::vector<ObservedPiece>* pieces_out) {
  for (size_t begin = 0; begin + 1 < points.size();) {
    size_t end = begin + 1;
    const auto fits = [&](size_t last) {
      if (!rule.joins_all && length(points[last].xy() - points[begin].xy()) > rule.longest_m) return false;
      for (size_t i = begin + 1; i < last; ++i) {
        if (distance_to_segment(points[i].xy(), points[begin].xy(), points[last].xy()) > rule.chord_error_m)
          return false;
      }
      return true;
    };
    while (end + 1 < points.size() && fits(end + 1)) ++end;
    const Vec2 way = points[end].xy() - points[begin].xy();
    const float way_m = length(way);
    const int cuts = std::max(1, static_cast<int>(std::ceil(way_m / rule.longest_m - 1e-4f)));
    for (int i = 0; i < cuts && way_m > 0; ++i) {
      const float fraction = (static_cast<float>(i) + 0.5f) / static_cast<float>(cuts);
      pieces_out->push_back({points[begin] + (points[end] - points[begin]) * fraction,
                             0.5f * way_m / static_cast<float>(cuts), way * (1.0f / way_m), extent});
    }
    begin = end;
  }
}

/// Adds lanes. `open` is null on maps whose roads do not end and on recorded scenes.
void add_lanes(const RoadMap& map, const PieceRule& rule, const OpenLanes* open, MapRules* out) {
  bool starts_in_junctions = open != nullptr;  // whether agents can start only in junctions
  for (size_t index = 0; index < map.lanes.size() && starts_in_junctions; ++index) {
    starts_in_junctions = map.lanes[index].in_junction || !is_open(map, *open, index);
  }
  out->lanes.resize(map.lanes.size());
  for (size_t index = 0; index < map.lanes.size(); ++index) {
    const Lane& lane = map.lanes[index];
    MapLane& flat = out->lanes[index];
    flat.first_segment = static_cast<int32_t>(out->segments.size());
    flat.first_successor = static_cast<int32_t>(out->successors.size());
    if (!is_drivable(lane.type)) continue;
    const bool is_driven = lane.type != LaneType::parking;
    flat.speed_limit_mps = lane.speed_limit_mps;

    std::vector<Vec3> line;
    const Span<const LanePoint> points = map.points_of(lane);
    float widest = 0, s = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      widest = std::max(widest, points[i].width_m);
      line.push_back(points[i].position_m);
      if (i + 1 == points.size()) break;
      const LanePoint& a = points[i];
      const LanePoint& b = points[i + 1];
      const Vec2 way = (b.position_m - a.position_m).xy();
      LaneSegment segment;
      segment.length_m = length(way);
      if (!(segment.length_m > 0)) continue;
      segment.a_m = a.position_m;
      segment.direction = way * (1.0f / segment.length_m);
      segment.slope = (b.position_m.z - a.position_m.z) / segment.length_m;
      segment.heading_rad = a.heading_rad;
      segment.turn_rad = wrap_angle(b.heading_rad - a.heading_rad);
      segment.half_width_m = 0.5f * std::max(a.width_m, b.width_m);
      segment.s_m = s;
      segment.lane = static_cast<int32_t>(index);
      segment.is_driven = is_driven;
      s += segment.length_m;
      out->segments.push_back(segment);
    }
    flat.length_m = s;
    flat.num_segments = static_cast<int32_t>(out->segments.size()) - flat.first_segment;
    if (is_driven) append_pieces(line, widest * (1.0f / kScaleLaneWidth_m), rule, &out->lane_pieces);

    const auto goes_on = [&](int32_t other) {
      if (other < 0) return false;
      const Lane& to = map.lanes[other];
      return open ? is_route(to.type) : to.is_endless;
    };
    for (const int32_t successor : map.links(lane.successors)) {
      if (goes_on(successor)) out->successors.push_back(successor);
    }
    flat.num_successors = static_cast<int32_t>(out->successors.size()) - flat.first_successor;
    for (const int32_t successor : map.links(lane.successors)) {
      if (!goes_on(successor)) out->successors.push_back(successor);
    }
    flat.num_all_successors = static_cast<int32_t>(out->successors.size()) - flat.first_successor;
    flat.left = goes_on(lane.left_neighbor) ? lane.left_neighbor : -1;
    flat.right = goes_on(lane.right_neighbor) ? lane.right_neighbor : -1;
    bool starts = lane.is_endless && !lane.in_junction;
    float starts_until_m = s;
    if (open && is_route(lane.type)) {
      const float way_m = s + open->way_after_m[index];
      if (way_m - kRouteEndMargin_m < s) flat.route_end_m = std::max(way_m - kRouteEndMargin_m, 0.0f);
      starts = lane.in_junction == starts_in_junctions;
      starts_until_m = std::min(s, way_m - kMinOpenWay_m);
    }
    if (starts && is_driven && starts_until_m > 0) {
      out->spawn_lanes.push_back(static_cast<int32_t>(index));
      out->spawn_end_m.push_back((out->spawn_end_m.empty() ? 0.0f : out->spawn_end_m.back()) + starts_until_m);
    }
  }
}

/// Adds exits and entries. Entries get the same `turn` if they are within kSharedTurn_m of each other, directly or
/// through other entries.
void add_openings(const OpenLanes& open, MapRules* out) {
  constexpr float kSharedTurn_m = 5.0f;
  for (const LaneOpening& exit : open.exits) {
    const MapLane& lane = out->lanes[static_cast<size_t>(exit.lane)];
    const LaneSegment& last = out->segments[static_cast<size_t>(lane.first_segment + lane.num_segments - 1)];
    out->exits.push_back({exit.middle_m, exit.direction, exit.half_width_m, last.slope});
  }
  for (size_t i = 0; i < open.entries.size(); ++i) {
    auto turn = static_cast<int32_t>(i);
    for (size_t j = 0; j < i; ++j) {
      const int32_t other = out->entries[j].turn;
      if (other == turn || length(open.entries[i].middle_m - open.entries[j].middle_m) > kSharedTurn_m) continue;
      const auto [kept, joined] = std::minmax(other, turn);
      for (Entry& entry : out->entries) entry.turn = entry.turn == joined ? kept : entry.turn;
      turn = kept;
    }
    out->entries.push_back({open.entries[i].lane, turn});
  }
}

void add_barriers(const RoadMap& map, Span<const WallFace> walls, const PieceRule& rule, MapRules* out) {
  std::vector<Vec3> line;
  const auto finish_line = [&] {
    if (line.size() > 1) append_pieces(line, 0.0f, rule, &out->boundary_pieces);
    line.clear();
  };
  for (const RoadEdge& edge : map.road_edges) {
    out->edges.push_back({edge.a_m.xy(), edge.b_m.xy(), 0.5f * (edge.a_m.z + edge.b_m.z)});
    // Consecutive edges that share a point form one polyline.
    if (line.empty() || line.back().x != edge.a_m.x || line.back().y != edge.a_m.y) {
      finish_line();
      line.push_back(edge.a_m);
    }
    line.push_back(edge.b_m);
  }
  finish_line();
  for (const WallFace& wall : walls) {
    out->walls.push_back({wall.a_m.xy(), wall.b_m.xy(), 0.5f * (wall.a_m.z + wall.b_m.z)});
    append_pieces({wall.a_m, wall.b_m}, wall.height_m * (1.0f / kScaleWallHeight_m), rule, &out->wall_pieces);
  }
}

void add_stop_lines(const RoadMap& map, MapRules* out) {
  for (size_t index = 0; index < map.lights.size(); ++index) {
    const TrafficLight& light = map.lights[index];
    StopLine line;
    line.left_m = light.stop_a_m;
    line.right_m = light.stop_b_m;
    line.middle_m = (light.stop_a_m + light.stop_b_m) * 0.5f;
    line.direction = {std::cos(light.stop_heading_rad), std::sin(light.stop_heading_rad)};
    line.half_length_m = 0.5f * length((light.stop_b_m - light.stop_a_m).xy());
    line.junction = light.junction;
    line.phase = light.phase;
    line.num_phases = light.junction < 0 ? 1 : std::max(1, map.junctions[light.junction].num_phases);
    out->stop_lines.push_back(line);
    for (int32_t i = light.lanes.begin; i < light.lanes.end; ++i) {
      int32_t& held_by = out->lanes[map.light_lanes[i]].light;
      if (held_by < 0) held_by = static_cast<int32_t>(index);
    }
  }
}

template <typename Item, typename ToBox>
Grid cells_of(const std::vector<Item>& items, ToBox&& to_box) {
  std::vector<Aabb2> boxes;
  boxes.reserve(items.size());
  for (const Item& item : items) boxes.push_back(to_box(item));
  return Grid(boxes, kLookupCell_m);
}

/// Adds a parking spot at the kerb nearest to p, if the kerb is within reach_m. In right-hand traffic, parked cars have
/// the kerb on their right. A road edge has the road on its right, so cars point in the direction opposite to the edge.
void add_kerb_spot(Vec3 p, float reach_m, MapRules* out) {
  const Barrier* nearest = nullptr;  // the first of equally near barriers
  float best_m = reach_m;
  visit_items(out->edge_cells.view(), box_of_segment(p.xy(), p.xy(), reach_m), [&](size_t item) {
    const Barrier& edge = out->edges[item];
    if (std::fabs(edge.z_m - p.z) >= kLevel_m) return;
    const float distance = distance_to_segment(p.xy(), edge.a_m, edge.b_m);
    const bool is_first = nearest && distance == best_m && &edge < nearest;
    if (!(distance < best_m || is_first)) return;
    best_m = distance;
    nearest = &edge;
  });
  if (!nearest) return;
  const Vec2 way = nearest->b_m - nearest->a_m;
  const float way_m = length(way);
  if (!(way_m > 0)) return;
  const Vec2 along = way * (1.0f / way_m);
  const Vec2 at = nearest->a_m + along * std::clamp(dot(p.xy() - nearest->a_m, along), 0.0f, way_m);
  out->parking_spots.push_back({{at.x, at.y, p.z}, std::atan2(-along.y, -along.x), left_normal(along)});
}

/// Adds parking spaces. Outside junctions, also adds spots at regular distances on parking lanes and at the kerbs of
/// shoulders and sidewalks.
void add_parking_spots(const RoadMap& map, MapRules* out) {
  constexpr float kSpacing_m = 7.0f;
  for (const ParkingSpace& space : map.parking_spaces) {
    out->parking_spots.push_back({space.center_m, space.heading_rad, {}});
  }
  for (const Lane& lane : map.lanes) {
    const bool is_kerb = lane.type == LaneType::shoulder || lane.type == LaneType::sidewalk;
    if (lane.in_junction || (!is_kerb && lane.type != LaneType::parking)) continue;
    const Span<const LanePoint> points = map.points_of(lane);
    float next_s = 0.5f * kSpacing_m;
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const LanePoint& a = points[i];
      const LanePoint& b = points[i + 1];
      for (; next_s < b.s_m; next_s += kSpacing_m) {
        const float fraction = std::clamp((next_s - a.s_m) / (b.s_m - a.s_m), 0.0f, 1.0f);
        const Vec3 at = a.position_m + (b.position_m - a.position_m) * fraction;
        if (is_kerb) {
          add_kerb_spot(at, 0.5f * a.width_m + 1.0f, out);
        } else {
          out->parking_spots.push_back({at, a.heading_rad, {}});
        }
      }
    }
  }
}

/// Stores the record and computes the maximum size and speed of its agents.
void add_record(MapRecord record, MapRules* out) {
  constexpr float kRoom = 1.0f + 1e-6f;  // margin for rounding
  out->max_box_radius_m = kMaxBoxRadius_m;
  out->max_speed_mps = kMaxSpeed_mps;
  for (const RecordedAgent& agent : record.agents) {
    out->max_box_radius_m = std::max(out->max_box_radius_m, 0.5f * kRoom * std::hypot(agent.length_m, agent.width_m));
  }
  for (size_t i = 1; i < record.states.size(); ++i) {
    const RecordedState &before = record.states[i - 1], &now = record.states[i];
    if (i % static_cast<size_t>(record.num_steps) == 0 || !before.is_present || !now.is_present) continue;
    out->max_speed_mps = std::max(out->max_speed_mps, length((now.position_m - before.position_m).xy()) / record.dt_s);
  }
  out->record = std::move(record);
}

/// Items within a range of a cell's centre, nearest first.
struct Neighbors {
  std::vector<int32_t> items;
  std::vector<float> distance_m;
  std::vector<float> x_m, y_m;  // relative to the centre

  size_t size() const { return items.size(); }
};

/// Finds the points of `cells` within range_m of `center`, nearest first. Equally far points are ordered by index.
/// `keys` is scratch memory.
void find_neighbors(const std::vector<Vec2>& points, const GridView& cells, Vec2 center, float range_m,
                    std::vector<uint64_t>* keys, Neighbors* out) {
  keys->clear();
  const Vec2 reach{range_m, range_m};
  visit_items(cells, {center - reach, center + reach}, [&](size_t item) {
    const float distance = length(points[item] - center);
    // Nonnegative floats have the same order as their bits. So the sort compares one integer per key, which is much
    // faster.
    if (distance <= range_m) keys->push_back(uint64_t{std::bit_cast<uint32_t>(distance)} << 32 | item);
  });
  std::sort(keys->begin(), keys->end());
  const size_t count = keys->size();
  out->items.resize(count);
  out->distance_m.resize(count);
  out->x_m.resize(count);
  out->y_m.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const auto item = static_cast<uint32_t>((*keys)[i]);
    out->items[i] = static_cast<int32_t>(item);
    out->distance_m[i] = std::bit_cast<float>(static_cast<uint32_t>((*keys)[i] >> 32));
    out->x_m[i] = points[item].x - center.x;
    out->y_m[i] = points[item].y - center.y;
  }
}

/// Makes lists for every cell that may contain an observer. For each cell, it calls append(neighbors, &lists), which
/// appends lists_per_cell lists; `neighbors` are the items whose points are within range_m of the cell's centre. Throws
/// Error, which names the map, if the lists would take more than a gigabyte. The limit also ensures that 32-bit indices
/// suffice.
template <typename Append>
CellLists lists_by_distance(const MapRules& map, const std::string& map_name, const std::vector<Vec2>& points,
                            float range_m, int lists_per_cell, Append&& append) {
  constexpr size_t kMaxItems = size_t{1} << 28;
  CellLists lists;
  lists.origin_m = map.low_m;
  lists.cell_m = kNearCell_m;
  lists.num_x = static_cast<int>((map.high_m.x - map.low_m.x) / kNearCell_m) + 1;
  lists.num_y = static_cast<int>((map.high_m.y - map.low_m.y) / kNearCell_m) + 1;
  const size_t num_cells = static_cast<size_t>(lists.num_x) * static_cast<size_t>(lists.num_y);

  std::vector<uint8_t> is_occupied(num_cells, 0);
  const GridView cells = lists.view();
  for (const LaneSegment& segment : map.segments) {
    const Vec2 a = segment.a_m.xy();
    const Aabb2 box = box_of_segment(a, a + segment.direction * segment.length_m, kObserverReach_m);
    visit_cells(cells, box, [&](size_t cell) { is_occupied[cell] = 1; });
  }

  std::vector<Aabb2> boxes;
  for (const Vec2& point : points) boxes.push_back({point, point});
  const Grid grid(boxes, 20.0f);
  const GridView point_cells = grid.view();
  const InterruptibleWork work(fmt::format("map {}: interrupted while it was compiled", map_name));
  std::vector<uint64_t> keys;
  Neighbors found;
  lists.begin.assign(1, 0);
  for (size_t cell = 0; cell < num_cells; ++cell) {
    work.check();
    if (is_occupied[cell] && !points.empty()) {
      const Vec2 center = lists.origin_m + Vec2{static_cast<float>(cell % static_cast<size_t>(lists.num_x)) + 0.5f,
                                                static_cast<float>(cell / static_cast<size_t>(lists.num_x)) + 0.5f} *
                                               kNearCell_m;
      find_neighbors(points, point_cells, center, range_m, &keys, &found);
      // The size is checked before the items are appended, because a single cell may exceed the limit.
      PICTURA_CHECK(lists.items.size() + found.size() * static_cast<size_t>(lists_per_cell) <= kMaxItems,
                    "map {}: expected at most {} entries in the lists of nearby elements, got more: too many elements "
                    "within {} m of ({}, {})",
                    map_name, kMaxItems, range_m, center.x, center.y);
      append(found, &lists);
    } else {
      lists.begin.insert(lists.begin.end(), static_cast<size_t>(lists_per_cell), lists.begin.back());
    }
  }
  return lists;
}

void end_list(CellLists* lists_inout) { lists_inout->begin.push_back(static_cast<int32_t>(lists_inout->items.size())); }

/// Determines which neighbours may be visible to an observer in the cell with a heading between two directions. `left`
/// must be less than 180 degrees counter-clockwise from `right`. The result is 1 or 0 for each neighbour, and never 0
/// for a visible neighbour. Neighbours must not be farther than the far corner of the visible range. Most of the time
/// of compiling a map is spent here, so the code uses neither angles nor branches. Conditions are integers, because
/// compilers vectorize only these.
void find_visible(const Neighbors& neighbors, Vec2 right, Vec2 left, std::vector<int32_t>* seen_out) {
  constexpr float most_behind_m = kRoadBehind_m + kCellRadius_m, most_aside_m = kRoadAside_m + kCellRadius_m;
  // As the heading turns, a piece behind the visible range can also enter it from the side, so pieces this close are
  // kept.
  const float close_m = std::sqrt(square(most_behind_m) + square(most_aside_m));
  const size_t count = neighbors.size();
  seen_out->resize(count);
  int32_t* seen = seen_out->data();
  const float *xs = neighbors.x_m.data(), *ys = neighbors.y_m.data(), *distances = neighbors.distance_m.data();
  for (size_t i = 0; i < count; ++i) {
    const float x_m = xs[i], y_m = ys[i], distance_m = distances[i];
    const float along_right_m = x_m * right.x + y_m * right.y, along_left_m = x_m * left.x + y_m * left.y;
    const float left_of_right_m = right.x * y_m - right.y * x_m, right_of_left_m = left.y * x_m - left.x * y_m;
    // Lateral distance at the heading that is nearest to the direction of the piece. The distance ahead at that heading
    // is not tested: as the heading turns away, a piece beyond the front of the visible range can enter its far corner.
    const float ahead_m = along_right_m > along_left_m ? along_right_m : along_left_m;
    const float aside_m = std::fabs(along_right_m > along_left_m ? left_of_right_m : right_of_left_m);
    const int32_t is_between = int32_t{left_of_right_m >= 0} & int32_t{right_of_left_m >= 0};
    const int32_t is_ahead = int32_t{ahead_m >= -most_behind_m};
    const int32_t is_beside = int32_t{aside_m <= most_aside_m} | int32_t{distance_m <= close_m};
    seen[i] = int32_t{distance_m <= most_behind_m} | is_between | (is_ahead & is_beside);
  }
}

/// Returns the direction at which a heading sector begins; see near_place().
Vec2 sector_begin(int sector) {
  const float heading_rad = -kPi + static_cast<float>(sector) * (kTwoPi / kSectors);
  return {std::cos(heading_rad), std::sin(heading_rad)};
}

std::vector<Vec2> middles_of(const std::vector<ObservedPiece>& pieces) {
  std::vector<Vec2> middles;
  for (const ObservedPiece& piece : pieces) middles.push_back(piece.middle_m.xy());
  return middles;
}

CellLists lists_of_pieces(const MapRules& map, const std::string& map_name, const std::vector<Vec2>& middles) {
  const float sight_m = std::sqrt(square(kRoadAhead_m) + square(kRoadAside_m)) + kCellRadius_m;
  std::vector<int32_t> seen;
  return lists_by_distance(map, map_name, middles, sight_m, kSectors,
                           [&seen](const Neighbors& neighbors, CellLists* lists) {
                             for (int sector = 0; sector < kSectors; ++sector) {
                               find_visible(neighbors, sector_begin(sector), sector_begin(sector + 1), &seen);
                               // To avoid a branch, each neighbour is written; if it is not visible, the next neighbour
                               // overwrites it.
                               size_t end = lists->items.size();
                               lists->items.resize(end + neighbors.size());
                               for (size_t i = 0; i < neighbors.size(); ++i) {
                                 lists->items[end] = neighbors.items[i];
                                 end += static_cast<size_t>(seen[i]);
                               }
                               lists->items.resize(end);
                               end_list(lists);
                             }
                           });
}

/// Returns the distance from an end of a stop line to the far side of the adjacent oncoming lanes. The distance ends at
/// lanes in the line's own direction, because other lines or none control these, and at the range of the stop line.
float oncoming_beyond_m(const MapView& map, const StopLine& line, Vec2 outward) {
  constexpr float kStep_m = 0.25f;
  float beyond_m = 0;
  for (float at_m = kStep_m; line.half_length_m + at_m <= kStopLineReach_m; at_m += kStep_m) {
    const Vec2 p = line.middle_m.xy() + outward * (line.half_length_m + at_m);
    for (const int32_t item : items_at(map.segment_cells, p)) {
      const LaneSegment& segment = map.segments[item];
      const Foot foot = foot_on(segment, p);
      const float height_m = height_on(segment, foot.along_m);
      if (!segment.is_driven || foot.distance_m > segment.half_width_m ||
          std::fabs(height_m - line.middle_m.z) >= kLevel_m)
        continue;
      const float cosine = dot(segment.direction, line.direction);
      if (cosine >= kStopLineCosine) return beyond_m;
      if (cosine <= -kStopLineCosine) beyond_m = at_m;
    }
  }
  return beyond_m;
}

/// Makes a list for each cell of all stop lines that can be among the nearest kMaxControls of an observer in the cell.
/// These are all lines up to a distance from the cell's centre: that of the kMaxControls-th nearest line, plus the
/// cell's diagonal.
CellLists lists_of_stop_lines(const MapRules& map, const std::string& map_name) {
  std::vector<Vec2> middles;
  for (const StopLine& line : map.stop_lines) middles.push_back(line.middle_m.xy());
  return lists_by_distance(
      map, map_name, middles, kControlRange_m + kNearCell_m, 1, [](const Neighbors& neighbors, CellLists* lists) {
        const float last_m = neighbors.size() < kMaxControls
                                 ? INFINITY
                                 : neighbors.distance_m[kMaxControls - 1] + std::sqrt(2.0f) * kNearCell_m;
        for (size_t i = 0; i < neighbors.size() && neighbors.distance_m[i] <= last_m; ++i) {
          lists->items.push_back(neighbors.items[i]);
        }
        end_list(lists);
      });
}

}  // namespace

MapRules make_map_rules(const RoadMap& map, Span<const WallFace> walls, bool observe_walls, MapRecord record,
                        float observed_span_m) {
  const PieceRule rule = piece_rule(observed_span_m);
  MapRules out;
  if (!record.agents.empty()) out.sides = side_edges_of(map);
  add_record(std::move(record), &out);
  std::optional<OpenLanes> open;
  if (out.record.agents.empty() && !has_endless_roads(map)) open = find_open_lanes(map);
  out.is_open = open.has_value();
  add_lanes(map, rule, open ? &*open : nullptr, &out);
  if (open) add_openings(*open, &out);
  PICTURA_CHECK(!out.segments.empty(), "map {}: expected at least one drivable lane, got none", map.name);
  add_barriers(map, walls, rule, &out);
  const auto barrier_box = [&out](const Barrier& barrier) {
    return box_of_segment(barrier.a_m, barrier.b_m, out.max_box_radius_m);
  };
  out.edge_cells = cells_of(out.edges, barrier_box);
  add_stop_lines(map, &out);
  add_parking_spots(map, &out);

  out.low_m = out.high_m = out.segments.front().a_m.xy();
  for (const LaneSegment& segment : out.segments) {
    const Vec2 a = segment.a_m.xy();
    const Aabb2 box = box_of_segment(a, a + segment.direction * segment.length_m, kObserverReach_m);
    out.low_m = {std::min(out.low_m.x, box.low.x), std::min(out.low_m.y, box.low.y)};
    out.high_m = {std::max(out.high_m.x, box.high.x), std::max(out.high_m.y, box.high.y)};
  }

  out.segment_cells = cells_of(out.segments, [](const LaneSegment& segment) {
    const Vec2 a = segment.a_m.xy();
    return box_of_segment(a, a + segment.direction * segment.length_m,
                          std::max(kLaneReach_m, segment.half_width_m + kSeamTolerance_m));
  });
  out.wall_cells = cells_of(out.walls, barrier_box);
  out.exit_cells = cells_of(out.exits, [](const Exit& exit) {
    const float reach_m = exit.half_width_m + kExitReach_m;
    return box_of_segment(exit.middle_m.xy(), exit.middle_m.xy(), reach_m);
  });
  out.stop_line_cells = cells_of(out.stop_lines, [](const StopLine& line) {
    return box_of_segment(line.middle_m.xy(), line.middle_m.xy(), kStopLineReach_m);
  });

  for (StopLine& line : out.stop_lines) {
    const Vec2 left = left_normal(line.direction);
    line.beyond_left_m = oncoming_beyond_m(out.view(), line, left);
    line.beyond_right_m = oncoming_beyond_m(out.view(), line, left * -1.0f);
  }

  out.walkways = make_walkways(map, out.view());
  std::vector<WalkPiece> pairs;
  for (size_t i = 0; i < out.walkways.pieces.size(); i += 2) pairs.push_back(out.walkways.pieces[i]);
  out.walk_cells = cells_of(pairs, [](const WalkPiece& piece) {
    return box_of_segment(piece.a_m.xy(), piece.a_m.xy() + piece.direction * piece.length_m, kWalkReach_m);
  });

  out.lane_middles = middles_of(out.lane_pieces);
  out.boundary_middles = middles_of(out.boundary_pieces);
  out.wall_middles = middles_of(out.wall_pieces);
  out.near_lane_pieces = lists_of_pieces(out, map.name, out.lane_middles);
  out.near_boundary_pieces = lists_of_pieces(out, map.name, out.boundary_middles);
  if (observe_walls) out.near_wall_pieces = lists_of_pieces(out, map.name, out.wall_middles);
  out.near_stop_lines = lists_of_stop_lines(out, map.name);
  return out;
}

int64_t MapRules::size_bytes() const {
  MapView arrays = view();
  size_t sum = 0;
  visit_arrays(&arrays, [&sum](const auto* span) {
    const size_t bytes = span->size() * sizeof(*span->data());
    sum += (bytes + kMapAlignment_bytes - 1) / kMapAlignment_bytes * kMapAlignment_bytes;
  });
  return static_cast<int64_t>(sum);
}

int32_t MapRecord::first_step(size_t agent) const {
  for (int32_t step = 0; step < num_steps; ++step) {
    if (state(agent, step).is_present) return step;
  }
  return -1;
}

MapView MapRules::view() const {
  MapView view;
  view.segments = segments;
  view.lanes = lanes;
  view.successors = successors;
  view.edges = edges;
  view.walls = walls;
  view.stop_lines = stop_lines;
  view.spawn_lanes = spawn_lanes;
  view.spawn_end_m = spawn_end_m;
  view.exits = exits;
  view.entries = entries;
  view.exit_cells = exit_cells.view();
  view.walk_pieces = walkways.pieces;
  view.walk_end_m = walkways.end_m;
  view.walk_leave_begin = walkways.leave_begin;
  view.walk_leaving = walkways.leaving;
  view.parking_spots = parking_spots;
  view.lane_pieces = lane_pieces;
  view.boundary_pieces = boundary_pieces;
  view.wall_pieces = wall_pieces;
  view.lane_middles = lane_middles;
  view.boundary_middles = boundary_middles;
  view.wall_middles = wall_middles;
  view.segment_cells = segment_cells.view();
  view.edge_cells = edge_cells.view();
  view.wall_cells = wall_cells.view();
  view.stop_line_cells = stop_line_cells.view();
  view.walk_cells = walk_cells.view();
  view.near_lane_pieces = near_lane_pieces.view();
  view.near_boundary_pieces = near_boundary_pieces.view();
  view.near_wall_pieces = near_wall_pieces.view();
  view.near_stop_lines = near_stop_lines.view();
  view.recorded_agents = record.agents;
  view.recorded_states = record.states;
  view.recorded_lights = record.light_states;
  view.recorded_steps = record.num_steps;
  view.first_replayed = record.first_replayed;
  view.side_edges = sides.edges;
  view.side_cells = sides.cells.view();
  view.max_box_radius_m = max_box_radius_m;
  view.max_speed_mps = max_speed_mps;
  view.is_open = is_open;
  return view;
}

}  // namespace pictura
