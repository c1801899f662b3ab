// Small road maps with numbers that a test can compute.
#pragma once

#include <memory>

#include "pictura/map/road_map.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// Returns `config` with vehicles only.
SimulatorConfig cars(SimulatorConfig config = {});

/// Makes a circular one-way road around the origin, counter-clockwise. Its four lanes of 4 m width are successive
/// quarter circles, with road edges on both sides.
std::shared_ptr<RoadMap> ring_road(float radius_m);

/// Makes a stadium-shaped one-way road: two straights of length straight_m along x, at y = 0 (eastwards) and y = 40
/// (westwards), joined by half circles. Lanes are 4 m wide; lane 0 is outermost (right). Lane i of the southern
/// straight is at y = 4 i.
std::shared_ptr<RoadMap> stadium(float straight_m, int num_lanes);

/// Adds a light for held_lanes, in phase 0 of num_phases. Its stop line crosses the southern lanes of a stadium at x_m,
/// on a width of width_m.
void add_light(RoadMap* map, float x_m, float width_m, int num_phases, std::vector<int32_t> held_lanes);

/// Adds an unlinked lane. Returns its index.
int32_t add_side_lane(RoadMap* map, LaneType type, const std::vector<Vec3>& points);

void add_crosswalk(RoadMap* map, const std::vector<Vec3>& corners);

}  // namespace pictura::testing
