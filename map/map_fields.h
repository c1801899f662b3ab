// Lists of the fields of RoadMap and its elements, by which maps are written, read and compared. An incomplete list
// does not compile.
#pragma once

#include <string>
#include <string_view>
#include <tuple>

#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

/// Defines fields_of(value), a tuple of references to the fields, and field_names_of(value), their names separated by
/// ", ". The order is that of the declaration.
#define PICTURA_FIELDS(Type, ...)            \
  inline auto fields_of(Type& value) {       \
    auto& [__VA_ARGS__] = value;             \
    return std::tie(__VA_ARGS__);            \
  }                                          \
  inline auto fields_of(const Type& value) { \
    const auto& [__VA_ARGS__] = value;       \
    return std::tie(__VA_ARGS__);            \
  }                                          \
  constexpr std::string_view field_names_of(const Type&) { return #__VA_ARGS__; }

namespace pictura {

/// Returns the i-th name passed to PICTURA_FIELDS.
inline std::string field_name_at(std::string_view names, std::size_t i) {
  for (; i > 0; --i) names.remove_prefix(names.find(',') + 2);
  return std::string(names.substr(0, names.find(',')));
}

PICTURA_FIELDS(Vec2, x, y)
PICTURA_FIELDS(Vec3, x, y, z)
PICTURA_FIELDS(IndexRange, begin, end)
PICTURA_FIELDS(LanePoint, position_m, heading_rad, width_m, s_m)
PICTURA_FIELDS(Lane, type, in_junction, is_endless, junction, points, successors, predecessors, left_neighbor,
               right_neighbor, length_m, speed_limit_mps, source_road, source_section, source_lane)
PICTURA_FIELDS(Marking, points, width_m, color, broken)
PICTURA_FIELDS(RoadEdge, a_m, b_m)
PICTURA_FIELDS(Crosswalk, outline)
PICTURA_FIELDS(ParkingSpace, center_m, heading_rad, length_m, width_m)
PICTURA_FIELDS(PaintedStopLine, a_m, b_m, width_m)
PICTURA_FIELDS(Sign, name, type, subtype, country, position_m, heading_rad, lanes)
PICTURA_FIELDS(TrafficLight, stop_a_m, stop_b_m, stop_heading_rad, head_m, head_facing, junction, phase, lanes, name)
PICTURA_FIELDS(Junction, name, num_phases)
PICTURA_FIELDS(BuildingLine, a_m, b_m)
PICTURA_FIELDS(SourceElement, road, line)
PICTURA_FIELDS(Provenance, lanes, markings, road_edges, crosswalks, parking_spaces, stop_lines, signs, lights,
               junctions, building_lines)
PICTURA_FIELDS(Repair, kind, line, message)
PICTURA_FIELDS(MapFacts, roads, junction_roads, junctions, signal_junctions, lanes, driving_lanes, driving_lane_km,
               driving_lane_km_in_junctions, traffic_lights, stop_lines, crosswalks, parking_spaces, painted_stop_lines,
               signs, z_min_m, z_max_m)
PICTURA_FIELDS(RoadMap, name, origin_m, geo_reference, road_names, lanes, lane_points, lane_links, markings,
               marking_points, road_edges, crosswalks, outline_points, parking_spaces, stop_lines, signs, sign_lanes,
               lights, light_lanes, junctions, building_lines, facts, provenance, mends)

PICTURA_FIELDS(PlanMap, xx, xy, yx, yy)
PICTURA_FIELDS(OpenDriveOptions, chord_error_m, strict, plan)

/// Calls visit(name, field) for each field of a struct that has a list.
template <typename T, typename Visit>
void visit_fields(const T& value, Visit&& visit) {
  std::size_t i = 0;
  std::apply([&](const auto&... field) { (visit(field_name_at(field_names_of(value), i++), field), ...); },
             fields_of(value));
}

/// See difference_of() in field_difference.h.
std::string first_difference(const RoadMap& a, const RoadMap& b);

}  // namespace pictura
