// Worlds from a recorded scene: compilation of its map with its tracks, the configuration of such worlds, and the
// selection of tracks by words such as "vehicles".
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

/// Compiles the map of a scene. The scene's tracks become the agents of its worlds, in the same order. Each agent
/// starts an episode in its recorded state at start_step; an agent without such a state starts absent. With
/// options.recorded_lights, the road has the scene's lights with their recorded states: they are drawn and observed,
/// and stop traffic. Recordings contain no positions of light heads; heads are placed kRecordedHeadAhead_m past the
/// middle of the stop line and kRecordedHeadHeight_m above it. Throws Error if the map has no drivable lane, if there
/// are more than kMaxAgentsPerWorld tracks, or if a track is too large to be simulated; the message names scene and
/// track. Throws UsageError for a null pointer, or if the recording has no step start_step.
std::shared_ptr<const CompiledMap> compile_scenario(std::shared_ptr<const Scenario> scenario,
                                                    const MapOptions& options = {}, int32_t start_step = 0);

/// Returns a scene's map for worlds of at most num_agents agents. The first agents are the tracks in `driven`, in this
/// order; further agents are never present. The tracks in `replayed` are not agents: they follow their records as the
/// first parked cars of a world (see SimulatorConfig::parked_cars). An agent whose track is absent at the start of an
/// episode takes no part in the episode. Throws UsageError unless 1 <= driven.size() <= num_agents.
std::shared_ptr<const CompiledMap> with_tracks(const CompiledMap& map, Span<const int32_t> driven,
                                               Span<const int32_t> replayed, int num_agents);

/// Adapts a configuration to a scene. The result has the recording's time step (at most kMaxStep_s), dynamics
/// multipliers of 1, and episodes that always last from start_step to the end of the recording. Removes walls, and all
/// parked cars except replayed tracks.
SimulatorConfig scene_config(const Scenario& scenario, int32_t start_step = 0, SimulatorConfig config = {});

/// Returns a world on a scene's map with one agent for each track. `index` is the index of the map among a simulator's
/// maps.
WorldSpec scene_world(const CompiledMap& map, int index = 0, uint32_t global_world = 0);

/// Returns [tracks]: 1 for each selected track, else 0. `words` are separated by commas: self or sdc (the self-driving
/// car), vehicles (other vehicles), others (all except vehicles), all, tracks_to_predict, objects_of_interest, and ids
/// of tracks. It is no error if a word selects no track. Throws UsageError for other words.
std::vector<uint8_t> tracks_selected_by(const Scenario& scenario, const std::string& words);
/// Variant of tracks_selected_by() that also throws UsageError for a word that selects no track.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words);
/// Variant of tracks_of() that excludes tracks that are absent at a step. Also throws UsageError if no track remains.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words, int32_t step);

/// Returns the distance on the ground plane from center_m to the track's recorded position at a step; nullopt if the
/// track has no recorded state at that step.
std::optional<float> displacement_m(const Scenario& scenario, int32_t track, int32_t step, Vec3 center_m);

}  // namespace pictura
