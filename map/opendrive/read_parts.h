// Stages of read_network().
#pragma once

#include <optional>

#include "pictura/map/opendrive/element.h"

namespace pictura::opendrive {

inline constexpr double kMinRoadLength_m = 1e-3, kMaxRoadLength_m = 1e5;
inline constexpr double kMaxOffset_m = 1e4, kMaxHeight_m = 1e4;

/// Reads <planView>, <elevationProfile> and <lateralProfile>. Sets the road's length to that of the line; later stages
/// need it. Returns the s up to which the file describes the road; see hold_profiles().
double read_reference_line(const Element& road_element, FileRoad* road);

void read_lanes(const Element& road_element, Faults* faults, FileRoad* road);

std::vector<RoadMark> read_marks(const Element& lane_element, double section_length);

/// Read <objects> and <signals>. The road's length must be set.
void read_objects(const Element& road_element, FileRoad* road);
void read_signals(const Element& road_element, FileRoad* road);

void read_road_links(const Element& road_element, FileRoad* road);
FileJunction read_junction(const Element& element);
FileController read_controller(const Element& element);

/// Returns the limit of a <speed> in m/s, or 0 for no limit. Repair: returns nullopt for an unreadable speed.
std::optional<double> read_speed_mps(const Element& element);

}  // namespace pictura::opendrive
