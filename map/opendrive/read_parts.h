// The parts of read_network: one function for each part of a road, in files of their own.
#pragma once

#include "pictura/map/opendrive/element.h"

namespace pictura::opendrive {

inline constexpr double kMaxRoadLength_m = 1e5;

/// <planView> and <elevationProfile>: the reference line. Needs the road's length.
void read_reference_line(const Element& road_element, FileRoad* road);

/// <lanes>: offset, sections, lanes with their marks.
void read_lanes(const Element& road_element, FileRoad* road);

/// <objects> and <signals>.
void read_objects(const Element& road_element, FileRoad* road);
void read_signals(const Element& road_element, FileRoad* road);

/// <link> of a road, <junction> and <controller>.
void read_road_links(const Element& road_element, FileRoad* road);
FileJunction read_junction(const Element& element);
FileController read_controller(const Element& element);

/// The attributes max and unit of a <speed>, in m/s; 0 where there is no limit.
double read_speed_mps(const Element& element);

}  // namespace pictura::opendrive
