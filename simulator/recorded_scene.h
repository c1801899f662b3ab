// Worlds from a recorded scene: its map compiled with its record, the configuration of such worlds, and the selection
// of their agents by words.
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

/// Compiles the map of a scene, whose tracks are the agents of its worlds, in their order. Each agent starts an episode
/// at its recorded state at start_step, or absent. With options.recorded_lights, the road has the scene's lights with
/// their recorded states: they are drawn, observed, and stop traffic. Recordings lack heads; these are placed
/// kRecordedHeadAhead_m past the middle of the stop line and kRecordedHeadHeight_m above it. Throws Error naming scene
/// and track when the map has no drivable lane, when there are more than kMaxAgentsPerWorld tracks, and when a track is
/// too large to be simulated. Throws UsageError for a null pointer, and for a step that the recording lacks.
std::shared_ptr<const CompiledMap> compile_scenario(std::shared_ptr<const Scenario> scenario,
                                                    const MapOptions& options = {}, int32_t start_step = 0);

/// Returns a scene's map for worlds of at most num_agents agents: the driven tracks in this order, then agents that are
/// never present. The replayed tracks are not agents: they are the first of a world's other boxes, whose number is
/// SimulatorConfig::parked_cars, and follow their records. An episode has only agents that are present at its start.
/// Throws UsageError unless 1 <= driven.size() <= num_agents.
std::shared_ptr<const CompiledMap> with_tracks(const CompiledMap& map, Span<const int32_t> driven,
                                               Span<const int32_t> replayed, int num_agents);

/// Adapts a configuration to a scene: the recording's time step, episodes as long as the recording from start_step on,
/// no walls, no parked cars besides the scene's tracks, no early end, and dynamics multipliers of 1.
SimulatorConfig scene_config(const Scenario& scenario, int32_t start_step = 0, SimulatorConfig config = {});

/// Returns the world of a scene's map, with all of its tracks.
WorldSpec scene_world(const CompiledMap& map, int index = 0, uint32_t global_world = 0);

/// Returns [tracks] 1 for tracks that comma-separated words select: self or sdc (the self-driving car), vehicles (other
/// vehicles), others (all except vehicles), all, tracks_to_predict, objects_of_interest, and ids of tracks. A word may
/// select no track. Throws UsageError for other words.
std::vector<uint8_t> tracks_selected_by(const Scenario& scenario, const std::string& words);
/// Variant of tracks_selected_by() that also throws UsageError for a word that selects no track.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words);
/// Variant of tracks_of() without tracks that are absent at a step. Also throws UsageError when no track remains.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words, int32_t step);

/// Distance on the ground from a box's centre to the recorded place of the track at a step; nullopt if the track has no
/// recorded state at that step.
std::optional<float> displacement_m(const Scenario& scenario, int32_t track, int32_t step, Vec3 center_m);

}  // namespace pictura
