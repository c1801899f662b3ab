// Stages that turn a Network into a RoadMap, in the order of execution.
#pragma once

#include <vector>

#include "pictura/common/scene.h"
#include "pictura/map/endless_lanes.h"
#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"

namespace pictura::opendrive {

/// A section's lanes in RoadMap::lanes, from the center outwards; -1 for lanes without surface.
struct SectionLanes {
  std::vector<int32_t> left, right;

  int32_t of(int id) const {
    const std::vector<int32_t>& side = id > 0 ? left : right;
    const std::size_t index = static_cast<std::size_t>(id > 0 ? id : -id) - 1;
    return id != 0 && index < side.size() ? side[index] : -1;
  }
};

/// State shared by the stages.
struct Build {
  const Network& network;
  const OpenDriveOptions& options;
  Faults* faults;
  RoadMap* map;
  SampleBudget budget;
  std::vector<std::vector<SectionLanes>> lanes;  // [roads][sections]
  struct LaneSource {
    const FileSection* section;
    const FileLane* lane;
  };
  std::vector<LaneSource> file_lanes;  // parallel to RoadMap::lanes
  StationCache stations;

  Vec3 to_map(const Eigen::Vector3d& p) const { return to_vec3(from_origin(p)); }
  /// Converts file coordinates to map coordinates, without rounding to float.
  Eigen::Vector3d from_origin(const Eigen::Vector3d& p) const {
    return p - Eigen::Vector3d{map->origin_m[0], map->origin_m[1], map->origin_m[2]};
  }
};

/// Whether traffic travels towards growing s. The sign of `side` is that of the side's lane ids.
constexpr bool travels_forward(const FileRoad& road, int side) { return (side < 0) != road.left_hand; }
inline bool travels_forward(const FileRoad& road, const FileLane& lane) {
  return travels_forward(road, lane.id) != (lane.direction == LaneDirection::reversed);
}

/// Sets the origin to the centre of the reference lines, in whole metres.
void choose_origin(Build* build);

/// `road` is an index in the network.
inline SourceElement source_of(std::size_t road, const SourceLocation& where) {
  return {static_cast<int32_t>(road), where.line()};
}

/// These stages build lanes of every type except "none": centre lines and neighbours, then links, then speed limits.
void build_lanes(Build* build);
void link_lanes(Build* build);
void set_speed_limits(Build* build);

void build_road_edges(Build* build);

/// Removes road edges where traffic leaves or enters a map without endless roads, and records missing links.
void open_road_ends(Build* build);

/// build_markings() builds lane marks. build_objects() builds crosswalks, parking spaces and stop lines.
void build_markings(Build* build);
void build_objects(Build* build);

/// Builds junctions, traffic lights and signs.
void build_signals(Build* build);

void build_building_lines(Build* build);

void count_facts(Build* build);

}  // namespace pictura::opendrive
