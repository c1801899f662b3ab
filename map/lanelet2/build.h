// The stages that turn an OsmFile into a RoadMap, in the order in which parse_lanelet2() runs them. Each fills its own
// vectors of the map and may read those of earlier stages.
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

/// A way in the direction of a lane's traffic.
struct Border {
  int32_t way = -1;
  bool is_reversed = false;

  auto operator<=>(const Border&) const = default;
  Border reversed() const { return {way, !is_reversed}; }
};

/// What a relation of type lanelet became.
struct Lanelet {
  int32_t relation = -1;
  int32_t road = -1;             // in RoadMap::road_names; -1 for crosswalks
  Border left, right;            // in its own direction
  int32_t lane = -1, back = -1;  // lanes of the map: its own, and of two-way ones that of the opposite traffic
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
  std::vector<std::pair<Border, Border>> lane_sides{};  // [map.lanes] left and right
  std::vector<SurfaceBand> bands{};                     // the drivable surface: lanes, then areas
  std::vector<int32_t> band_roads{};                    // [bands] index into road_names, or -1

  /// Converts file coordinates to map coordinates.
  Eigen::Vector3d from_origin(const Eigen::Vector3d& p) const {
    return p - Eigen::Vector3d{map->origin_m[0], map->origin_m[1], map->origin_m[2]};
  }
  /// Counts work on so many items, so that no file can take minutes.
  void count_work(std::size_t items) {
    constexpr std::size_t kItemsPerSample = 8;
    for (std::size_t i = 0; i < items; i += kItemsPerSample) budget.count_sample();
  }
  /// The points of a border about the origin.
  Points points_of(const Border& border);
  Points points_of(int32_t way) { return points_of(Border{way, false}); }

  int32_t first_node(const Border& border) const {
    const std::vector<int32_t>& nodes = file.ways[border.way].nodes;
    return border.is_reversed ? nodes.back() : nodes.front();
  }
  int32_t last_node(const Border& border) const { return first_node(border.reversed()); }
  const Relation& relation_of(const Lanelet& lanelet) const { return file.relations[lanelet.relation]; }
  SourceElement source_of(int32_t road, std::ptrdiff_t offset) const { return {road, file.source.line_at(offset)}; }
  /// The lane of a relation that is a lanelet; -1 for all others, and for crosswalks.
  int32_t lane_of(int32_t relation) const {
    const int32_t lanelet = lanelet_of_relation[relation];
    return lanelet < 0 ? -1 : lanelets[lanelet].lane;
  }
};

/// The point at a fraction of a line's length in plan.
Eigen::Vector3d point_at_fraction(const Points& line, double fraction);

/// The points (about the origin) without repeated ones and with pieces of at most kMaxPiece_m. Fewer than two if the
/// line has no length.
std::vector<CurvePoint> cut_line(const std::vector<CurvePoint>& line, SampleBudget* budget);
std::vector<CurvePoint> cut_line(const Points& line, SampleBudget* budget);

/// Whether vehicles drive there: by the tags participant:*, else by the subtype. For lanelets and areas.
bool is_for_vehicles(const Tags& tags);

/// Chooses lanelets with two borders, aligns these, and sets the map's origin: the centre of their points, in whole
/// metres. Leaves out nodes' far from there. Throws Error if there is no lanelet.
void find_lanelets(Build* build);
/// Lanes, links, neighbours, junctions, speed limits; crosswalks.
void build_lanes(Build* build);
/// Adds the surface of drivable areas to the bands.
void build_areas(Build* build);
/// The outline of the bands, and barriers between lanes.
void build_edges(Build* build);
/// Markings, stop lines and parking spaces.
void build_paint(Build* build);
/// Traffic lights and signs.
void build_rules(Build* build);
void count_facts(Build* build);

}  // namespace pictura::lanelet2
