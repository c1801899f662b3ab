// Who does what when a recorded scene is evaluated: which road users are driven, which follow the recording, and which
// are taken out of it. Without torch headers.
#pragma once

#include <vector>

#include "pictura/evaluation/scene_protocol.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// A scene as a protocol has it: with boxes of its scale. Throws Error where its time step is not 0.1 s.
std::shared_ptr<const Scenario> protocol_scene(Scenario scenario, const SceneProtocol& protocol);

/// [tracks] 1 for those that thinning takes out: of the road users besides the self-driving car round((1 - density) n),
/// by a draw of seed and scenario id. Those of a density are among those of every lower one.
std::vector<uint8_t> thinned_out(const Scenario& scenario, double density, uint64_t seed);

enum class SceneRole : uint8_t { removed, replayed, driven };

struct ScenePlan {
  std::vector<SceneRole> roles;         // [tracks]
  std::vector<int32_t> takeover_steps;  // [tracks] of the episode, at which a driven one is there
};

/// Whether the scene has anybody to drive, whatever the density and who overlaps. Where it has not, all vehicles are
/// parked, or none is there.
bool has_drivers(const CompiledMap& map, const SceneProtocol& protocol);

/// The roles in a world of the map, compiled from protocol.start_step on. boxes [tracks]: those of its scene at the
/// start of the episode.
ScenePlan plan_scene(const CompiledMap& map, Span<const AgentBox> boxes, const SceneProtocol& protocol, double density,
                     uint64_t seed);

/// Waypoints::path: of a driven track the places on its recorded path at a third and two thirds of the way from its
/// takeover to its goal, and the goal.
std::vector<Vec3> path_waypoints(const CompiledMap& map, int32_t track, int32_t takeover_step);

}  // namespace pictura
