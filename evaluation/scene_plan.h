// Roles in the evaluation of a recorded scene: road users that are driven, that follow the recording, and that are
// removed. Has no torch headers.
#pragma once

#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

/// Adapts a scene to a protocol by scaling the scene's boxes. Throws Error if the scene's time step is not 0.1 s.
std::shared_ptr<const Scenario> protocol_scene(Scenario scenario, const SceneProtocol& protocol);

/// Selects the tracks that thinning removes, [tracks]. It removes round((1 - density) n) of the n road users besides
/// the self-driving car, drawn by seed and scenario id. Tracks removed at a density are also removed at every lower
/// density.
std::vector<uint8_t> select_thinned_tracks(const Scenario& scenario, double density, uint64_t seed);

enum class SceneRole : uint8_t { removed, replayed, driven };

struct ScenePlan {
  std::vector<SceneRole> roles;         // [tracks]
  std::vector<int32_t> takeover_steps;  // [tracks] episode step at which a driven track appears
};

/// Whether the scene has a road user to drive, ignoring density and overlaps. If not, all vehicles are parked, or the
/// scene has no vehicle.
bool has_drivers(const CompiledMap& map, const SceneProtocol& protocol);

/// Plans the roles in a world of the map, which must be compiled from protocol.start_step on. boxes: [tracks] boxes at
/// the start of the episode.
ScenePlan plan_scene(const CompiledMap& map, Span<const AgentBox> boxes, const SceneProtocol& protocol, double density,
                     uint64_t seed);

/// Waypoints of Waypoints::path: points of a driven track's recorded path at one and two thirds of the distance from
/// its takeover to its goal, and the goal.
std::vector<Vec3> path_waypoints(const CompiledMap& map, int32_t track, int32_t takeover_step);

}  // namespace pictura
