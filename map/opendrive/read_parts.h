// The parts of read_network, one function per part of a road, each in its own file.
#pragma once

#include <optional>

#include "pictura/map/opendrive/element.h"

namespace pictura::opendrive {

inline constexpr double kMinRoadLength_m = 1e-3, kMaxRoadLength_m = 1e5;
inline constexpr double kMaxOffset_m = 1e4, kMaxHeight_m = 1e4;

/// <planView>, <elevationProfile> and <lateralProfile>: the reference line, its elevation and banking. Needs the road's
/// length, which becomes that of the line: read the other parts afterwards. Returns the s up to which the file
/// describes the road; see hold_profiles().
double read_reference_line(const Element& road_element, FileRoad* road);

/// <lanes>: lane offset, sections, lanes with their marks.
void read_lanes(const Element& road_element, Faults* faults, FileRoad* road);

/// The <roadMark> elements of a lane in a section of the given length.
std::vector<RoadMark> read_marks(const Element& lane_element, double section_length);

/// <objects> and <signals>. Need the road's length.
void read_objects(const Element& road_element, FileRoad* road);
void read_signals(const Element& road_element, FileRoad* road);

/// <link> of a road, <junction> and <controller>.
void read_road_links(const Element& road_element, FileRoad* road);
FileJunction read_junction(const Element& element);
FileController read_controller(const Element& element);

/// The attributes max and unit of a <speed>, in m/s; 0: no limit. Mended: one that cannot be read, for which there is
/// no value.
std::optional<double> read_speed_mps(const Element& element);

}  // namespace pictura::opendrive
