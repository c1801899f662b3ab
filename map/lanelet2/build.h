// Stages that turn an OsmFile into a RoadMap, in the order of execution.
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

/// A way that borders a lane, in the direction of the lane's traffic.
struct Border {
  int32_t way = -1;
  bool is_reversed = false;

  auto operator<=>(const Border&) const = default;
  Border reversed() const { return {way, !is_reversed}; }
};

/// A relation of type lanelet.
struct Lanelet {
  int32_t relation = -1;
  int32_t road = -1;             // in RoadMap::road_names; -1 for crosswalks
  Border left, right;            // in the lanelet's direction
  int32_t lane = -1, back = -1;  // `back` is the opposite lane of a two-way lanelet
};

/// State shared by the stages.
struct Build {
  const OsmFile& file;
  const OpenDriveOptions& options;
  opendrive::Faults* faults;
  RoadMap* map;
  SampleBudget budget;
  std::vector<Lanelet> lanelets{};
  std::vector<int32_t> lanelet_of_relation{};           // [relations] index in lanelets, or -1
  std::vector<std::pair<Border, Border>> lane_sides{};  // [map.lanes] left and right
  std::vector<SurfaceBand> bands{};                     // drivable surface: bands of lanes, then of areas
  std::vector<int32_t> band_roads{};                    // [bands] index in road_names, or -1

  /// Converts file coordinates to map coordinates.
  Eigen::Vector3d from_origin(const Eigen::Vector3d& p) const {
    return p - Eigen::Vector3d{map->origin_m[0], map->origin_m[1], map->origin_m[2]};
  }
  /// Throws Error at the limit of work, so that no file can take minutes.
  void count_work(std::size_t items) {
    constexpr std::size_t kItemsPerSample = 8;
    for (std::size_t i = 0; i < items; i += kItemsPerSample) budget.count_sample();
  }
  /// Returns points relative to the origin.
  Points points_of(const Border& border);
  Points points_of(int32_t way) { return points_of(Border{way, false}); }

  int32_t first_node(const Border& border) const {
    const std::vector<int32_t>& nodes = file.ways[border.way].nodes;
    return border.is_reversed ? nodes.back() : nodes.front();
  }
  int32_t last_node(const Border& border) const { return first_node(border.reversed()); }
  const Relation& relation_of(const Lanelet& lanelet) const { return file.relations[lanelet.relation]; }
  SourceElement source_of(int32_t road, std::ptrdiff_t offset) const { return {road, file.source.line_at(offset)}; }
  /// Returns the lane of a relation, or -1.
  int32_t lane_of(int32_t relation) const {
    const int32_t lanelet = lanelet_of_relation[relation];
    return lanelet < 0 ? -1 : lanelets[lanelet].lane;
  }
};

/// Measures the fraction in plan.
Eigen::Vector3d point_at_fraction(const Points& line, double fraction);

/// Cuts a line into pieces of at most kMaxPiece_m, without repeated points. A line without length gives fewer than two
/// points.
std::vector<CurvePoint> cut_line(const std::vector<CurvePoint>& line, SampleBudget* budget);
std::vector<CurvePoint> cut_line(const Points& line, SampleBudget* budget);

/// Tags participant:* take precedence over the subtype.
bool is_for_vehicles(const Tags& tags);

/// Selects lanelets with two borders and aligns the borders. Sets the origin to the centre of their points, in whole
/// metres. Throws Error without lanelets, or if a node is too far from the origin.
void find_lanelets(Build* build);
/// Builds lanes, junctions and crosswalks.
void build_lanes(Build* build);
/// Adds drivable areas to the bands.
void build_areas(Build* build);
/// Builds road edges from the outline of the bands and from barriers between lanes.
void build_edges(Build* build);
/// Builds markings, stop lines and parking spaces.
void build_paint(Build* build);
void build_rules(Build* build);
void count_facts(Build* build);

}  // namespace pictura::lanelet2
