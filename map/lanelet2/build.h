// Stages that turn an OsmFile into a RoadMap, in the order in which parse_lanelet2() runs them. Each stage fills its
// own vectors of the map and may read vectors of earlier stages.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/lanelet2/osm.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"
#include "pictura/map/surface.h"

namespace pictura::lanelet2 {

using Points = std::vector<Eigen::Vector3d>;

/// A way (polyline of the file) that borders a lane, in the direction of the lane's traffic.
struct Border {
  int32_t way = -1;
  bool is_reversed = false;

  auto operator<=>(const Border&) const = default;
  Border reversed() const { return {way, !is_reversed}; }
};

/// A relation of type lanelet: its borders and its lanes in the map.
struct Lanelet {
  int32_t relation = -1;
  int32_t road = -1;             // in RoadMap::road_names; -1 for crosswalks
  Border left, right;            // in the lanelet's direction
  int32_t lane = -1, back = -1;  // lanes of the map; `back` is the opposite lane of a two-way lanelet
};

/// State shared by the stages.
struct Build {
  const OsmFile& file;
  const OpenDriveOptions& options;
  opendrive::Faults* faults;
  RoadMap* map;
  SampleBudget budget;
  std::vector<Lanelet> lanelets{};
  std::vector<int32_t> lanelet_of_relation{};           // [relations] index into lanelets, or -1
  std::vector<std::pair<Border, Border>> lane_sides{};  // [map.lanes] left and right border
  std::vector<SurfaceBand> bands{};                     // drivable surface: bands of lanes, then of areas
  std::vector<int32_t> band_roads{};                    // [bands] index into road_names, or -1

  /// Converts file coordinates to map coordinates.
  Eigen::Vector3d from_origin(const Eigen::Vector3d& p) const {
    return p - Eigen::Vector3d{map->origin_m[0], map->origin_m[1], map->origin_m[2]};
  }
  /// Counts `items` steps of work against the budget, so that no file can take minutes.
  void count_work(std::size_t items) {
    constexpr std::size_t kItemsPerSample = 8;
    for (std::size_t i = 0; i < items; i += kItemsPerSample) budget.count_sample();
  }
  /// Returns the points of a border, relative to the origin.
  Points points_of(const Border& border);
  Points points_of(int32_t way) { return points_of(Border{way, false}); }

  int32_t first_node(const Border& border) const {
    const std::vector<int32_t>& nodes = file.ways[border.way].nodes;
    return border.is_reversed ? nodes.back() : nodes.front();
  }
  int32_t last_node(const Border& border) const { return first_node(border.reversed()); }
  const Relation& relation_of(const Lanelet& lanelet) const { return file.relations[lanelet.relation]; }
  SourceElement source_of(int32_t road, std::ptrdiff_t offset) const { return {road, file.source.line_at(offset)}; }
  /// Returns the lane of a lanelet relation, or -1 for other relations and for crosswalks.
  int32_t lane_of(int32_t relation) const {
    const int32_t lanelet = lanelet_of_relation[relation];
    return lanelet < 0 ? -1 : lanelets[lanelet].lane;
  }
};

/// Returns the point at a fraction of a line's length in plan.
Eigen::Vector3d point_at_fraction(const Points& line, double fraction);

/// Returns a line (relative to the origin) without repeated points, cut into pieces of at most kMaxPiece_m. The result
/// has fewer than two points if the line has no length.
std::vector<CurvePoint> cut_line(const std::vector<CurvePoint>& line, SampleBudget* budget);
std::vector<CurvePoint> cut_line(const Points& line, SampleBudget* budget);

/// Whether vehicles may drive on a lanelet or area with these tags. Tags participant:* take precedence over the
/// subtype.
bool is_for_vehicles(const Tags& tags);

/// Selects lanelets with two borders, aligns the borders, and sets the map's origin to the centre of their points, in
/// whole metres. Throws Error if there is no lanelet or if a node of a way is too far from the origin.
void find_lanelets(Build* build);
/// Builds lanes (with links, neighbours, junctions and speed limits) and crosswalks.
void build_lanes(Build* build);
/// Adds the surface of drivable areas to the bands.
void build_areas(Build* build);
/// Builds road edges from the outline of the bands and from barriers between lanes.
void build_edges(Build* build);
/// Builds markings, stop lines and parking spaces.
void build_paint(Build* build);
/// Builds traffic lights and signs.
void build_rules(Build* build);
void count_facts(Build* build);

}  // namespace pictura::lanelet2
