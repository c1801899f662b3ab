// Builds drivable areas beside lanes, and road edges from the outline of the whole drivable surface and from barriers
// between lanes.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "pictura/common/scene.h"
#include "pictura/map/endless_lanes.h"
#include "pictura/map/lanelet2/build.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/road_edges.h"

namespace pictura::lanelet2 {

namespace {

constexpr double kSameCorner_m = 1e-3;

double area_of(const Points& a, std::size_t i, std::size_t j, std::size_t k) {
  const Eigen::Vector2d u = (a[j] - a[i]).head<2>(), v = (a[k] - a[i]).head<2>();
  return u.x() * v.y() - u.y() * v.x();
}

/// Returns twice the area of a ring; positive if the ring runs counter-clockwise.
double signed_area(const Points& ring) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) sum += area_of(ring, 0, i, i + 1);
  return sum;
}

/// Whether two sides of a ring that share no corner cross or touch.
bool crosses_itself(const Points& ring, SampleBudget* budget) {
  const std::size_t n = ring.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i + 2; k < n; ++k) {
      if (i == 0 && k + 1 == n) continue;
      budget->count_sample();
      const std::size_t j = i + 1, l = (k + 1) % n;
      if (area_of(ring, i, j, k) * area_of(ring, i, j, l) <= 0 &&
          area_of(ring, k, l, i) * area_of(ring, k, l, j) <= 0) {
        return true;
      }
    }
  }
  return false;
}

/// Splits a ring into triangles by ear clipping, and returns the indices of their corners. Returns nullopt if the ring
/// crosses itself.
std::optional<std::vector<std::array<std::size_t, 3>>> triangulate(const Points& ring, SampleBudget* budget) {
  if (crosses_itself(ring, budget)) return std::nullopt;
  std::vector<std::size_t> left(ring.size());
  std::iota(left.begin(), left.end(), std::size_t{0});
  if (signed_area(ring) < 0) std::reverse(left.begin(), left.end());
  std::vector<std::array<std::size_t, 3>> triangles;
  const auto is_ear = [&](std::size_t at) {
    const std::size_t a = left[(at + left.size() - 1) % left.size()], b = left[at], c = left[(at + 1) % left.size()];
    if (area_of(ring, a, b, c) <= 0) return false;
    return std::none_of(left.begin(), left.end(), [&](std::size_t p) {
      budget->count_sample();
      return p != a && p != b && p != c && area_of(ring, a, b, p) >= 0 && area_of(ring, b, c, p) >= 0 &&
             area_of(ring, c, a, p) >= 0;
    });
  };
  while (left.size() > 3) {
    std::size_t ear = 0;
    while (ear < left.size() && !is_ear(ear)) ++ear;
    if (ear == left.size()) {
      // A point on a straight line is not a corner, and is removed.
      ear = 0;
      const auto corner = [&](std::size_t at) {
        return std::abs(
            area_of(ring, left[(at + left.size() - 1) % left.size()], left[at], left[(at + 1) % left.size()]));
      };
      while (ear < left.size() && corner(ear) > 1e-9) ++ear;
      if (ear == left.size()) return std::nullopt;
    } else {
      triangles.push_back({left[(ear + left.size() - 1) % left.size()], left[ear], left[(ear + 1) % left.size()]});
    }
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

class AreaBuilder {
 public:
  explicit AreaBuilder(Build* build) : build_(*build), file_(build->file) {}

  void run() {
    for (const Relation& relation : file_.relations) {
      const std::string_view type = relation.tags.of("type");
      if ((type != "multipolygon" && type != "area") || !is_drivable_area(relation.tags)) continue;
      build_.budget.work().check();
      bool has_surface = false;
      for (const Points& ring : rings_of(relation, "outer")) has_surface |= add_surface(ring, relation);
      if (!has_surface) continue;
      for (Points ring : rings_of(relation, "inner")) add_hole(&ring);
    }
    // Parking lots of Autoware's maps are closed without a repeated point.
    for (const Way& way : file_.ways) {
      if (way.tags.of("type") != "parking_lot" || way.nodes.size() < 3) continue;
      add_surface(without_repeated(build_.points_of(static_cast<int32_t>(&way - file_.ways.data()))), way);
    }
  }

 private:
  static bool is_drivable_area(const Tags& tags) {
    const std::string_view subtype = tags.of("subtype");
    return subtype == "parking" || subtype == "freespace" || (!subtype.empty() && is_for_vehicles(tags));
  }

  static Points without_repeated(Points ring) {
    const auto is_same = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return plan_distance_m(a, b) < kSameCorner_m;
    };
    ring.erase(std::unique(ring.begin(), ring.end(), is_same), ring.end());
    while (ring.size() > 1 && is_same(ring.front(), ring.back())) ring.pop_back();
    return ring;
  }

  /// Joins the ways with a role at shared points, and returns the closed rings. Records a fault for each other ring.
  std::vector<Points> rings_of(const Relation& relation, std::string_view role) {
    std::vector<int32_t> ways = relation.ways(role);
    std::erase_if(ways, [&](int32_t way) { return file_.ways[way].nodes.size() < 2; });
    std::vector<Points> rings;
    while (!ways.empty()) {
      Border at{ways.front(), false};
      ways.erase(ways.begin());
      const int32_t first = build_.first_node(at);
      Points ring = build_.points_of(at);
      while (build_.last_node(at) != first) {
        const auto next = std::find_if(ways.begin(), ways.end(), [&](int32_t way) {
          build_.budget.count_sample();
          return build_.first_node({way, false}) == build_.last_node(at) ||
                 build_.last_node({way, false}) == build_.last_node(at);
        });
        if (next == ways.end()) break;
        at = {*next, build_.first_node({*next, false}) != build_.last_node(at)};
        ways.erase(next);
        const Points more = build_.points_of(at);
        ring.insert(ring.end(), more.begin() + 1, more.end());
      }
      ring = without_repeated(std::move(ring));
      if (build_.last_node(at) == first && ring.size() >= 3)
        rings.push_back(std::move(ring));
      else
        record_fault(relation);
    }
    return rings;
  }

  template <typename Item>
  void record_fault(const Item& item) const {
    file_.where(item).record_repair(build_.faults, RepairKind::open_area,
                                    "expected a closed outline that does not cross itself");
  }

  /// Returns whether the ring is an outline.
  template <typename Item>
  bool add_surface(const Points& ring, const Item& item) {
    const auto triangles = ring.size() < 3 ? std::nullopt : triangulate(ring, &build_.budget);
    if (!triangles) {
      record_fault(item);
      return false;
    }
    for (const auto& [a, b, c] : *triangles) {
      // A triangle is stored as a quad with a corner in the middle of a side.
      build_.bands.push_back({{ring[a], ring[c]}, {0.5 * (ring[a] + ring[b]), ring[b]}});
      build_.band_roads.push_back(-1);
    }
    return true;
  }

  /// Adds the edges of a hole. The surface around the hole is on the right of a counter-clockwise ring.
  void add_hole(Points* ring) {
    if (signed_area(*ring) < 0) std::reverse(ring->begin(), ring->end());
    ring->push_back(ring->front());
    const std::vector<CurvePoint> line = cut_line(*ring, &build_.budget);
    for (std::size_t i = 1; i < line.size(); ++i) {
      build_.map->road_edges.push_back({to_vec3(line[i - 1].position_m), to_vec3(line[i].position_m)});
      build_.map->provenance.road_edges.push_back({});
    }
  }

  Build& build_;
  const OsmFile& file_;
};

/// Whether a line is a barrier that no vehicle crosses. A low curb is not a barrier, because vehicles drive over it.
bool is_barrier(const Tags& tags) {
  const std::string_view type = tags.of("type");
  if (type == "curbstone") return tags.of("subtype") != "low";
  return type == "road_border" || type == "wall" || type == "fence" || type == "guard_rail" ||
         type == "jersey_barrier" || type == "gate";
}

}  // namespace

void build_areas(Build* build) { AreaBuilder(build).run(); }

void build_edges(Build* build) {
  RoadMap& map = *build->map;
  std::vector<int32_t> bands_of_edges;
  const std::vector<RoadEdge> outline = outline_of(build->bands, double{build->options.chord_error_m}, &bands_of_edges);
  map.road_edges.insert(map.road_edges.end(), outline.begin(), outline.end());
  for (const int32_t band : bands_of_edges) map.provenance.road_edges.push_back({build->band_roads[band], 0});
  if (!has_endless_roads(map)) {
    const OpenLanes open = find_open_lanes(map);
    for (const OpenLanes::MissingLink& link : open.missing_links) {
      const Lane &from = map.lanes[link.from], &to = map.lanes[link.to];
      const opendrive::SourceLocation where{&build->file.source, 0, "lanelet " + map.road_names[from.source_road],
                                            "relation"};
      build->faults->record_repair(
          {RepairKind::missing_link, map.provenance.lanes[link.from].line,
           fmt::format("{}: <relation>: ends {:.2f} m from the start of lanelet {}, with which it "
                       "shares no points there",
                       where.owner, link.gap_m, map.road_names[to.source_road])},
          build->file.source.name());
    }
    remove_edges_across_openings(open, &map);
  }
  // A barrier with lanes on both sides is an edge for both.
  std::map<int32_t, int> sides;  // by way: 1 if a lane is on its right, 2 if on its left, 3 if on both sides
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (!is_drivable(map.lanes[i].type)) continue;
    const auto& [left, right] = build->lane_sides[i];
    sides[left.way] |= left.is_reversed ? 2 : 1;
    sides[right.way] |= right.is_reversed ? 1 : 2;
  }
  for (const auto& [index, beside] : sides) {
    const Way& way = build->file.ways[index];
    if (beside != 3 || !is_barrier(way.tags)) continue;
    const std::vector<CurvePoint> line = cut_line(build->points_of(index), &build->budget);
    for (const bool is_reversed : {false, true}) {
      for (std::size_t i = 1; i < line.size(); ++i) {
        const std::size_t at = is_reversed ? line.size() - i : i;
        const Vec3 a = to_vec3(line[at - 1].position_m), b = to_vec3(line[at].position_m);
        map.road_edges.push_back(is_reversed ? RoadEdge{b, a} : RoadEdge{a, b});
        map.provenance.road_edges.push_back(build->source_of(-1, way.offset));
      }
    }
  }
}

}  // namespace pictura::lanelet2
