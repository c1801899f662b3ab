// Roles of road users in a recorded scene.
#pragma once

#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

/// Throws Error naming the scene if its time step is not 0.1 s. 1 % of tolerance, because WOMD's steps are of 0.1000 to
/// 0.1002 s.
void check_time_step(const Scenario& scenario);

/// Scales the scene's boxes. Replaces a track's first heading by its second if they differ by more than
/// SceneProtocol::max_first_turn_deg. Throws Error if the scene's time step is not 0.1 s.
std::shared_ptr<const Scenario> protocol_scene(Scenario scenario, const SceneProtocol& protocol);

/// Returns [tracks]: whether to remove the track. Removes round((1 - density) n) of the n road users other than the
/// self-driving car. The random choice depends on seed and scenario id. Lower densities also remove these tracks.
std::vector<uint8_t> select_thinned_tracks(const Scenario& scenario, double density, uint64_t seed);

enum class SceneRole : uint8_t { removed, replayed, driven };

struct ScenePlan {
  std::vector<SceneRole> roles;         // [tracks]
  std::vector<int32_t> takeover_steps;  // [tracks] episode step at which the driven track appears
};

/// Returns whether any road user can be driven, before thinning and checks of overlap.
bool has_drivers(const CompiledMap& map, const SceneProtocol& protocol);

/// map: compiled for episodes from protocol.start_step on. boxes: [tracks] at the episode's start.
ScenePlan plan_scene(const CompiledMap& map, Span<const AgentBox> boxes, const SceneProtocol& protocol, double density,
                     uint64_t seed);

/// Returns a driven track's Waypoints::path: points at one third and two thirds of the recorded path after the
/// takeover, and the goal.
std::vector<Vec3> path_waypoints(const CompiledMap& map, int32_t track, int32_t takeover_step);

}  // namespace pictura
