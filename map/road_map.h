// RoadMap: the validated, immutable road network. Positions are in metres relative to an origin. Indices refer to
// vectors of the same RoadMap; -1 means none.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/grid.h"
#include "pictura/common/math.h"
#include "pictura/common/span.h"
#include "pictura/map/repairs.h"

namespace pictura {

enum class LaneType : uint8_t {
  driving,
  bidirectional,
  parking,
  ramp,  // last drivable type
  shoulder,
  sidewalk,
  biking,
  median,
  border,
  stop,
  restricted,
  other,
};

/// The road edges are the outline of the drivable lanes.
constexpr bool is_drivable(LaneType type) { return type <= LaneType::ramp; }
const char* to_string(LaneType type);

/// Minimum difference in height between levels of road, such as a bridge and the road below it.
constexpr float kSameRoadLevel_m = 2.0f;

/// Half-open range of indices.
struct IndexRange {
  int32_t begin = 0, end = 0;
  int32_t size() const { return end - begin; }
};

/// A sample of a lane's centre line, in the direction of travel. Samples are at most kMaxPiece_m apart.
struct LanePoint {
  Vec3 position_m;
  float heading_rad = 0;
  float width_m = 0;
  float s_m = 0;  // arc length
};

struct Lane {
  LaneType type = LaneType::other;
  bool in_junction = false;
  bool is_endless = false;  // a route from here can continue without end
  int32_t junction = -1;
  IndexRange points;                                // in RoadMap::lane_points, at least two
  IndexRange successors, predecessors;              // in RoadMap::lane_links, which holds lane indices
  int32_t left_neighbor = -1, right_neighbor = -1;  // same direction; Lanelet2: across borders that permit changes
  float length_m = 0;
  float speed_limit_mps = 0;
  // Indices of the road and the section in the file. source_lane is OpenDRIVE's lane id; in Lanelet2, it is 1, or -1
  // for the opposite lane of a two-way lanelet.
  int32_t source_road = 0, source_section = 0, source_lane = 0;
};

enum class MarkColor : uint8_t { white, yellow, red, green, blue, orange, violet, black };
const char* to_string(MarkColor color);

/// A painted stripe or dash. A double line is two markings, and a broken line is many.
struct Marking {
  IndexRange points;  // in RoadMap::marking_points, at least two
  float width_m = 0;
  MarkColor color = MarkColor::white;
  bool broken = false;
};

/// A piece of the drivable surface's outline, at most kMaxPiece_m long. The surface is on its right.
struct RoadEdge {
  Vec3 a_m, b_m;
};

struct Crosswalk {
  IndexRange outline;  // in RoadMap::outline_points: a ring that does not repeat its first point
};

struct ParkingSpace {
  Vec3 center_m;
  float heading_rad = 0;
  float length_m = 0, width_m = 0;
};

/// A painted stop line, whether or not a light or sign controls it.
struct PaintedStopLine {
  Vec3 a_m, b_m;
  float width_m = 0;
};

/// A traffic sign and the lanes to which it applies.
struct Sign {
  std::string name;           // the signal's id in the file
  std::string type, subtype;  // "206" is a stop sign in OpenDRIVE's own catalogue
  std::string country;
  Vec3 position_m;
  float heading_rad = 0;  // heading of the affected traffic
  IndexRange lanes;       // in RoadMap::sign_lanes
};

/// A traffic light and the lanes that it controls.
struct TrafficLight {
  Vec3 stop_a_m, stop_b_m;     // left end first, as seen by traffic
  float stop_heading_rad = 0;  // travel direction of the controlled traffic
  Vec3 head_m;                 // centre
  Vec2 head_facing;            // unit vector towards the controlled traffic
  int32_t junction = -1;       // -1: away from junctions
  // Lights of one phase are green together. Phases are in the order of the junction's controllers. Without controllers,
  // headings determine the phases.
  int32_t phase = 0;
  IndexRange lanes;  // in RoadMap::light_lanes, incoming lanes first, then connecting lanes
  std::string name;  // the signal's id in the file
};

struct Junction {
  std::string name;  // id in the file
  int32_t num_phases = 0;
};

/// A line behind the sidewalk, along which walls may be placed.
struct BuildingLine {
  Vec3 a_m, b_m;  // the road is on the right of a -> b
};

/// Source of an element. `road` is an index in RoadMap::road_names. `line` is the XML element's line, or 0 if there is
/// none.
struct SourceElement {
  int32_t road = -1, line = 0;
};

/// Sources of elements, parallel to RoadMap's vectors.
struct Provenance {
  std::vector<SourceElement> lanes, markings, road_edges, crosswalks, parking_spaces, stop_lines, signs, lights,
      junctions, building_lines;
};

/// Minimum length of counted lanes. Shorter lanes come from roads without length.
inline constexpr float kShortestLane_m = 0.01f;

/// Counts that `pictura map` prints.
struct MapFacts {
  int32_t roads = 0, junction_roads = 0, junctions = 0, signal_junctions = 0, lanes = 0, driving_lanes = 0;
  double driving_lane_km = 0, driving_lane_km_in_junctions = 0;  // along the reference lines
  int32_t traffic_lights = 0, stop_lines = 0, crosswalks = 0, parking_spaces = 0;
  int32_t painted_stop_lines = 0, signs = 0;
  double z_min_m = 0, z_max_m = 0;
};

struct RoadMap {
  std::string name;                     // "Town01", "procedural:7", or the file's stem
  std::array<double, 3> origin_m{};     // file coordinates of (0, 0, 0)
  std::string geo_reference;            // PROJ string of the file's coordinates; may be empty
  std::vector<std::string> road_names;  // [roads] id in the file

  std::vector<Lane> lanes;
  std::vector<LanePoint> lane_points;
  std::vector<int32_t> lane_links;
  std::vector<Marking> markings;
  std::vector<Vec3> marking_points;
  std::vector<RoadEdge> road_edges;
  std::vector<Crosswalk> crosswalks;
  std::vector<Vec3> outline_points;
  std::vector<ParkingSpace> parking_spaces;
  std::vector<PaintedStopLine> stop_lines;
  std::vector<Sign> signs;
  std::vector<int32_t> sign_lanes;
  std::vector<TrafficLight> lights;
  std::vector<int32_t> light_lanes;
  std::vector<Junction> junctions;
  std::vector<BuildingLine> building_lines;
  MapFacts facts;
  Provenance provenance;
  std::vector<Repair> mends;

  Span<const LanePoint> points_of(const Lane& lane) const {
    return {lane_points.data() + lane.points.begin, static_cast<size_t>(lane.points.size())};
  }
  Span<const int32_t> links(IndexRange range) const {
    return {lane_links.data() + range.begin, static_cast<size_t>(range.size())};
  }
};

/// Throws Error, which names the element, if an index, length, width or coordinate is invalid or a link is not mutual.
void validate(const RoadMap& map);

}  // namespace pictura
