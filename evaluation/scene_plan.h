// Roles of road users in the evaluation of a recorded scene. A driver drives some road users, some follow the
// recording, and some are removed. Includes no torch headers.
#pragma once

#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

/// Adapts a scene to a protocol: scales its boxes, and replaces a track's first heading by its second if they differ
/// too much (SceneProtocol::max_first_turn_deg). Throws Error if the scene's time step is not 0.1 s.
std::shared_ptr<const Scenario> protocol_scene(Scenario scenario, const SceneProtocol& protocol);

/// Returns [tracks]: 1 for each track that thinning removes, else 0. Thinning removes round((1 - density) n) of the n
/// road users other than the self-driving car. Seed and scenario id determine the random choice. Tracks removed at a
/// density are also removed at every lower density.
std::vector<uint8_t> select_thinned_tracks(const Scenario& scenario, double density, uint64_t seed);

enum class SceneRole : uint8_t { removed, replayed, driven };

struct ScenePlan {
  std::vector<SceneRole> roles;         // [tracks]
  std::vector<int32_t> takeover_steps;  // [tracks] episode step at which a driven track appears
};

/// Returns whether the scene has a road user to drive, before thinning and even if its box overlaps another. A scene
/// has none, for instance, if all of its vehicles are parked.
bool has_drivers(const CompiledMap& map, const SceneProtocol& protocol);

/// Plans the roles of road users in a world of `map`, which must be compiled for episodes from protocol.start_step on.
/// boxes: [tracks] boxes at the start of the episode.
ScenePlan plan_scene(const CompiledMap& map, Span<const AgentBox> boxes, const SceneProtocol& protocol, double density,
                     uint64_t seed);

/// Returns the waypoints of a driven track for Waypoints::path. The first two are at one third and two thirds of its
/// recorded path after the takeover. The last is the goal.
std::vector<Vec3> path_waypoints(const CompiledMap& map, int32_t track, int32_t takeover_step);

}  // namespace pictura
