// Worlds that come from a recorded scene: its map compiled with what was recorded there, how they are configured, and
// which of their agents a word names.
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

/// The map of a scene, whose worlds' agents are its tracks, in their order: each starts an episode where the recording
/// has it at start_step, or absent. Throws Error naming scene and track when it has no drivable lane, more than
/// kMaxAgentsPerWorld tracks, or a track too large to be simulated; UsageError for a null pointer, and for a step that
/// the recording does not have. With options.recorded_lights its road has the scene's lights, whose states are those
/// recorded: they are drawn, observed, and hold traffic. Recordings do not have their heads, which are put
/// kRecordedHeadAhead_m past the middle of the stop line, and kRecordedHeadHeight_m above it.
std::shared_ptr<const CompiledMap> compile_scenario(std::shared_ptr<const Scenario> scenario,
                                                    const MapOptions& options = {}, int32_t start_step = 0);

/// A configuration, but with the recording's time step and its length from start_step on as an episode's, without
/// walls, without parked cars besides its tracks, without an early end, and with multipliers of the dynamics of 1.
SimulatorConfig scene_config(const Scenario& scenario, int32_t start_step = 0, SimulatorConfig config = {});

/// The world of a scene's map: all of its tracks.
WorldSpec scene_world(const CompiledMap& map, int index = 0, uint32_t global_world = 0);

/// [tracks] 1 for those that words with commas between them name: self or sdc (the self-driving car), vehicles (the
/// others), others (who is no vehicle), all, tracks_to_predict, objects_of_interest, and ids of tracks. A word may name
/// nobody. Throws UsageError for another word.
std::vector<uint8_t> tracks_named(const Scenario& scenario, const std::string& words);
/// The same. Throws UsageError as well for a word that names nobody.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words);
/// The same but for those that are not there at a step. Throws UsageError as well when nobody is left.
std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words, int32_t step);

/// How far a box's centre is, on the ground, from where the recording has the track at a step; nullopt where it has it
/// nowhere.
std::optional<float> displacement_m(const Scenario& scenario, int32_t track, int32_t step, Vec3 center_m);

}  // namespace pictura
