// Small road maps made by hand, whose every number a test can compute, and the population for these maps.
#pragma once

#include <memory>

#include "pictura/map/road_map.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// Returns `config` with vehicles alone: no pedestrians, cyclists or parked cars, for which these maps have no places.
SimulatorConfig cars(SimulatorConfig config = {});

/// Makes a circular one-way road of `radius_m` around the origin, driven counter-clockwise. One lane of 4 m is cut into
/// four lanes of a quarter each, with road edges on both sides.
std::shared_ptr<RoadMap> ring_road(float radius_m);

/// Makes a stadium-shaped one-way road: two straights of `straight_m` along x, at y = 0 (eastwards) and y = 40
/// (westwards), joined by half circles. It has `num_lanes` lanes of 4 m with neighbours; lane 0 is outermost (right).
/// Lane i of the southern straight is at y = 4 i.
std::shared_ptr<RoadMap> stadium(float straight_m, int num_lanes);

/// Adds a light whose stop line crosses all southern lanes of a stadium at x_m, held by `junction` and phase 0 of
/// num_phases.
void add_light(RoadMap* map, float x_m, float width_m, int num_phases, std::vector<int32_t> held_lanes);

/// Adds a lane of `type` along `points` that no link leads to; returns its index.
int32_t add_side_lane(RoadMap* map, LaneType type, const std::vector<Vec3>& points);

/// Adds a crosswalk with corners `corners`.
void add_crosswalk(RoadMap* map, const std::vector<Vec3>& corners);

}  // namespace pictura::testing
