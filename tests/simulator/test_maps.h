// Small hand-made road maps, all of whose numbers a test can compute, and options for the agents on these maps.
#pragma once

#include <memory>

#include "pictura/map/road_map.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// Returns `config` with vehicles only. These maps have no places for pedestrians, cyclists or parked cars.
SimulatorConfig cars(SimulatorConfig config = {});

/// Makes a circular one-way road of radius radius_m around the origin, with traffic counter-clockwise. It has four
/// lanes, one after the other, each a quarter circle of 4 m width, and road edges on both sides.
std::shared_ptr<RoadMap> ring_road(float radius_m);

/// Makes a stadium-shaped one-way road: two straights of length straight_m along x, at y = 0 (eastwards) and y = 40
/// (westwards), joined by half circles. It has num_lanes neighbouring lanes of 4 m width; lane 0 is outermost (right).
/// Lane i of the southern straight is at y = 4 i.
std::shared_ptr<RoadMap> stadium(float straight_m, int num_lanes);

/// Adds a light that controls held_lanes, in phase 0 of a junction's num_phases. Its stop line crosses the southern
/// lanes of a stadium at x_m; the lanes are width_m wide together.
void add_light(RoadMap* map, float x_m, float width_m, int num_phases, std::vector<int32_t> held_lanes);

/// Adds a lane of `type` along `points`, to which no link leads. Returns its index.
int32_t add_side_lane(RoadMap* map, LaneType type, const std::vector<Vec3>& points);

/// Adds a crosswalk with these corners.
void add_crosswalk(RoadMap* map, const std::vector<Vec3>& corners);

}  // namespace pictura::testing
