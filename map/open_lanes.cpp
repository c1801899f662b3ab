#include "pictura/map/open_lanes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "pictura/map/endless_lanes.h"

namespace pictura {

namespace {

constexpr float kMissingLink_m = 1.0f;

const Lane& lane_at(const RoadMap& map, int32_t lane) { return map.lanes[lane]; }
bool is_route_lane(const RoadMap& map, int32_t lane) { return is_route(lane_at(map, lane).type); }

LaneOpening opening_of(const RoadMap& map, int32_t lane, bool at_start) {
  const Span<const LanePoint> points = map.points_of(lane_at(map, lane));
  const LanePoint& end = at_start ? points[0] : points[points.size() - 1];
  return {lane, end.position_m, {std::cos(end.heading_rad), std::sin(end.heading_rad)}, 0.5f * end.width_m};
}

/// Starts of all driving and ramp lanes, sorted by x.
class LaneStarts {
 public:
  explicit LaneStarts(const RoadMap& map) {
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (!is_route(map.lanes[i].type)) continue;
      starts_.push_back({map.points_of(map.lanes[i])[0].position_m, static_cast<int32_t>(i)});
    }
    std::sort(starts_.begin(), starts_.end(),
              [](const Start& a, const Start& b) { return a.position_m.x < b.position_m.x; });
  }

  /// Calls visit(lane, distance in plan) for each lane that starts within kMissingLink_m of p, on the level of p.
  template <typename Visit>
  void visit_near(Vec3 p, Visit&& visit) const {
    auto start = std::lower_bound(starts_.begin(), starts_.end(), p.x - kMissingLink_m,
                                  [](const Start& a, float x_m) { return a.position_m.x < x_m; });
    for (; start != starts_.end() && start->position_m.x <= p.x + kMissingLink_m; ++start) {
      const float apart_m = length((start->position_m - p).xy());
      const bool is_level = std::fabs(start->position_m.z - p.z) < kSameRoadLevel_m;
      if (is_level && apart_m <= kMissingLink_m) visit(start->lane, apart_m);
    }
  }

 private:
  struct Start {
    Vec3 position_m;
    int32_t lane;
  };
  std::vector<Start> starts_;
};

/// Length of the longest route after each group of lanes. A group contains lanes that begin and end together, between
/// which agents can change lanes. Groups on which endless routes start are excluded, so the graph of groups has no
/// cycles.
class RemainingRouteLengths {
 public:
  RemainingRouteLengths(const RoadMap& map, const LaneGroups& groups) : way_after_m_(map.lanes.size(), INFINITY) {
    std::vector<int> successors_left(map.lanes.size(), 0);
    std::vector<std::size_t> ready;
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (!is_route(map.lanes[i].type)) continue;
      for (const int32_t next : map.links(map.lanes[i].successors)) {
        successors_left[groups.of_lane[i]] += is_route_lane(map, next);
      }
    }
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (!is_route(map.lanes[i].type) || groups.of_lane[i] != i || successors_left[i] > 0) continue;
      way_after_m_[i] = 0;
      ready.push_back(i);
    }
    std::vector<float> longest_m(map.lanes.size(), 0);
    while (!ready.empty()) {
      const std::size_t group = ready.back();
      ready.pop_back();
      float own_m = 0;
      for (const std::size_t lane : groups.members[group]) own_m = std::max(own_m, map.lanes[lane].length_m);
      for (const std::size_t lane : groups.members[group]) {
        for (const int32_t before : map.links(map.lanes[lane].predecessors)) {
          if (!is_route_lane(map, before)) continue;
          const std::size_t other = groups.of_lane[before];
          longest_m[other] = std::max(longest_m[other], way_after_m_[group] + own_m);
          if (--successors_left[other] > 0) continue;
          way_after_m_[other] = longest_m[other];
          ready.push_back(other);
        }
      }
    }
  }

  float after_m(std::size_t group) const { return way_after_m_[group]; }

 private:
  std::vector<float> way_after_m_;  // [lanes] for the leftmost lane of each group
};

// An edge crosses an opening if it passes within kOff_m of its middle. It is cut kBeyond_m beyond the opening's sides.
constexpr float kOff_m = 0.1f, kBeyond_m = 0.05f;

/// Appends the parts of an edge that are beside an opening and at least kMinEdge_m long. The edge across an opening
/// passes through its middle. It is not always perpendicular to the lane, because centre lines are oblique where lanes
/// widen.
void append_edge_parts_beside(const RoadEdge& edge, const LaneOpening& opening, std::vector<RoadEdge>* parts_out) {
  constexpr float kMinEdge_m = 0.01f, kMaxAlong = 0.7f;
  const Vec2 a = edge.a_m.xy() - opening.middle_m.xy(), edge_m = (edge.b_m - edge.a_m).xy();
  const float length_m = length(edge_m);
  const Vec2 way = edge_m * (1 / length_m);
  const bool is_across = std::fabs(dot(way, opening.direction)) < kMaxAlong && std::fabs(cross(way, a)) < kOff_m;
  const bool is_level = std::fabs(edge.a_m.z - opening.middle_m.z) < kSameRoadLevel_m;
  // Positions along the edge: the opening is between begin_m and end_m.
  const float reach_m = opening.half_width_m + kBeyond_m, begin_m = -dot(a, way) - reach_m,
              end_m = begin_m + 2 * reach_m;
  if (!is_across || !is_level || end_m < 0 || begin_m > length_m) {
    parts_out->push_back(edge);
    return;
  }
  const auto point_at = [&](float along_m) { return edge.a_m + (edge.b_m - edge.a_m) * (along_m / length_m); };
  if (begin_m > kMinEdge_m) parts_out->push_back({edge.a_m, point_at(begin_m)});
  if (length_m - end_m > kMinEdge_m) parts_out->push_back({point_at(end_m), edge.b_m});
}

/// Openings, exits before entries, that are found by x.
class Openings {
 public:
  explicit Openings(const OpenLanes& open) : all_(open.exits) {
    all_.insert(all_.end(), open.entries.begin(), open.entries.end());
    for (std::size_t i = 0; i < all_.size(); ++i) {
      by_x_.emplace_back(all_[i].middle_m.x, i);
      reach_m_ = std::max(reach_m_, all_[i].half_width_m + kBeyond_m + kOff_m);
    }
    std::sort(by_x_.begin(), by_x_.end());
  }

  /// Returns the openings that may be on an edge, in their order.
  std::vector<const LaneOpening*> near(const RoadEdge& edge) const {
    const auto [low, high] = std::minmax(edge.a_m.x, edge.b_m.x);
    std::vector<std::size_t> found;
    auto at = std::lower_bound(by_x_.begin(), by_x_.end(), std::pair{low - reach_m_, std::size_t{0}});
    for (; at != by_x_.end() && at->first <= high + reach_m_; ++at) found.push_back(at->second);
    std::sort(found.begin(), found.end());
    std::vector<const LaneOpening*> openings;
    for (const std::size_t i : found) openings.push_back(&all_[i]);
    return openings;
  }

 private:
  std::vector<LaneOpening> all_;
  std::vector<std::pair<float, std::size_t>> by_x_;
  float reach_m_ = 0;
};

}  // namespace

bool has_endless_roads(const RoadMap& map) {
  return std::any_of(map.lanes.begin(), map.lanes.end(),
                     [](const Lane& lane) { return lane.is_endless && !lane.in_junction; });
}

OpenLanes find_open_lanes(const RoadMap& map) {
  const LaneGroups groups = group_lanes(map);
  const RemainingRouteLengths ways(map, groups);
  const LaneStarts starts(map);
  OpenLanes open;
  open.way_after_m.assign(map.lanes.size(), INFINITY);
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (is_route(map.lanes[i].type)) open.way_after_m[i] = ways.after_m(groups.of_lane[i]);
  }
  for (std::size_t group = 0; group < map.lanes.size(); ++group) {
    bool is_led_to = false;
    std::vector<LaneOpening> exits, entries;
    const std::size_t links_before = open.missing_links.size();
    for (const std::size_t i : groups.members[group]) {
      if (!is_route(map.lanes[i].type)) continue;
      const auto lane = static_cast<int32_t>(i);
      for (const int32_t before : map.links(map.lanes[i].predecessors)) is_led_to |= is_route_lane(map, before);
      if (is_open(map, open, i)) entries.push_back(opening_of(map, lane, true));
      if (open.way_after_m[i] > 0) continue;
      exits.push_back(opening_of(map, lane, false));
      starts.visit_near(exits.back().middle_m, [&](int32_t other, float gap_m) {
        if (groups.of_lane[other] == group) return;
        // Skips the opposite lane of a two-way lane, which begins there.
        if (dot(opening_of(map, other, true).direction, exits.back().direction) <= 0) return;
        open.missing_links.push_back({lane, other, gap_m});
      });
    }
    if (!is_led_to) open.entries.insert(open.entries.end(), entries.begin(), entries.end());
    if (open.missing_links.size() == links_before) open.exits.insert(open.exits.end(), exits.begin(), exits.end());
  }
  return open;
}

bool is_open(const RoadMap& map, const OpenLanes& open, std::size_t lane) {
  const float ahead_m = map.lanes[lane].length_m + open.way_after_m[lane];
  return is_route(map.lanes[lane].type) && ahead_m >= kMinOpenWay_m && ahead_m < INFINITY;
}

void remove_edges_across_openings(const OpenLanes& open, RoadMap* map_inout) {
  RoadMap& map = *map_inout;
  const Openings openings(open);
  std::vector<RoadEdge> kept, parts, next;
  std::vector<SourceElement> sources;
  for (std::size_t i = 0; i < map.road_edges.size(); ++i) {
    parts = {map.road_edges[i]};
    for (const LaneOpening* opening : openings.near(map.road_edges[i])) {
      next.clear();
      for (const RoadEdge& part : parts) append_edge_parts_beside(part, *opening, &next);
      parts.swap(next);
    }
    kept.insert(kept.end(), parts.begin(), parts.end());
    sources.insert(sources.end(), parts.size(), map.provenance.road_edges[i]);
  }
  map.road_edges = std::move(kept);
  map.provenance.road_edges = std::move(sources);
}

LaneUse count_lane_use(const RoadMap& map) {
  LaneUse use;
  const bool is_endless = has_endless_roads(map);
  const OpenLanes open = find_open_lanes(map);
  std::vector<uint8_t> is_driven(map.lanes.size(), 0);
  std::vector<std::size_t> frontier;
  const auto reach = [&](std::size_t lane) {
    if (is_driven[lane] || !is_route(map.lanes[lane].type)) return;
    is_driven[lane] = 1;
    frontier.push_back(lane);
  };
  for (std::size_t i = 0; i < map.lanes.size() && !is_endless; ++i) {
    if (is_open(map, open, i)) reach(i);
  }
  while (!frontier.empty()) {
    const std::size_t lane = frontier.back();
    frontier.pop_back();
    for (const int32_t next : map.links(map.lanes[lane].successors)) reach(static_cast<std::size_t>(next));
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (!is_route(map.lanes[i].type) || map.lanes[i].length_m < kShortestLane_m) continue;
    ++(map.lanes[i].is_endless ? use.endless : is_driven[i] ? use.open : use.unreachable);
  }
  return use;
}

}  // namespace pictura
