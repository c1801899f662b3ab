// Worlds from a recorded scene.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

constexpr float kRecordedHeadAhead_m = 15.0f, kRecordedHeadHeight_m = 5.0f;

/// Compiles the map of a scene. Its tracks become the agents of worlds, in the same order. Each agent starts an episode
/// in its recorded state at start_step, or is absent if it has none. With options.recorded_lights, the scene's lights
/// are drawn and observed, and stop traffic. Light heads are not recorded; they are drawn kRecordedHeadAhead_m past the
/// stop line. Throws Error, which names the scene or track, if there is no drivable lane, if there are more than
/// kMaxAgentsPerWorld tracks, or if a track's box is too large. Throws UsageError for a null pointer or if the
/// recording has no step start_step.
std::shared_ptr<const CompiledMap> compile_scenario(std::shared_ptr<const Scenario> scenario,
                                                    const MapOptions& options = {}, int32_t start_step = 0);

/// Map of a scene for worlds of at most num_agents agents. The first agents are the tracks in `driven`; further agents
/// are never present. The tracks in `replayed` follow their records; their boxes replace those of the first parked
/// cars. An agent whose track is absent at the start takes no part in the episode. Throws UsageError unless 1 <=
/// driven.size() <= num_agents.
std::shared_ptr<const CompiledMap> with_tracks(const CompiledMap& map, Span<const int32_t> driven,
                                               Span<const int32_t> replayed, int num_agents);

/// Adapts a configuration to a scene: the recording's time step (at most kMaxStep_s), dynamics multipliers of 1,
/// episodes from start_step to the recording's end, no walls, and no parked cars except replayed tracks.
SimulatorConfig scene_config(const Scenario& scenario, int32_t start_step = 0, SimulatorConfig config = {});

/// World with one agent for each track. `index` is the map's index in the simulator.
WorldSpec scene_world(const CompiledMap& map, int index = 0, uint32_t global_world = 0);

/// Returns a mask [tracks]: 1 for each selected track. `words` are separated by commas: self or sdc (the self-driving
/// car), vehicles (other vehicles), others (all except vehicles), all, tracks_to_predict, objects_of_interest, and
/// track ids. Throws UsageError for other words, but not for words that select no track.
std::vector<uint8_t> tracks_selected_by(const Scenario& scenario, const std::string& words);
/// Returns the same as tracks_selected_by(). Also throws UsageError for a word that selects no track.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words);
/// Returns the tracks of tracks_of() that are present at a step. Also throws UsageError if no track remains.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words, int32_t step);

/// Horizontal distance from center_m to the track's recorded position; nullopt without a recorded state.
std::optional<float> displacement_m(const Scenario& scenario, int32_t track, int32_t step, Vec3 center_m);

}  // namespace pictura
