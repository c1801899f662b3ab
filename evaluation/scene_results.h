// Results of evaluated vehicles in recorded scenes: by road user, by scene, and over all scenes; and the file format
// from which parts of an evaluation are merged. Has no torch headers.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

// List of counts: X(type, name in files).
#define PICTURA_SCENE_COUNTS(X)                                      \
  X(int64_t, vehicles)                                               \
  X(int64_t, at_fault)                                               \
  X(int64_t, collision)                                              \
  X(int64_t, off_road)                                               \
  X(int64_t, goals)         /* vehicles that arrived */              \
  X(int64_t, infractions)   /* vehicles at fault or off the road */  \
  X(int64_t, measured)      /* vehicles with a known displacement */ \
  X(double, displacement_m) /* sum of their mean displacements */    \
  X(double, distance_m)                                              \
  X(int64_t, driven_steps) /* of all driven road users */

/// Counts over the driven vehicles of all rollouts of one scene at one density. A vehicle counts once per event,
/// however often the event happens.
struct SceneCounts {
#define X(type, name) type name = 0;
  PICTURA_SCENE_COUNTS(X)
#undef X

  /// Calls visit(name in files, count) for all counts of `counts`, a SceneCounts.
  template <typename Counts, typename Visit>
  static void visit(Counts& counts, const Visit& visit) {
#define X(type, name) visit(#name, counts.name);
    PICTURA_SCENE_COUNTS(X)
#undef X
  }
};

/// Counts of an evaluation in the scenes first_scene, first_scene + 1, ... of all scenes of its setting.
struct SceneResults {
  EvaluationSetting setting;  // `maps` holds SceneEvaluateOptions::scenes
  SceneProtocol protocol;
  // Files and trailing parts of files without readable scenes, with reasons; of the whole input, not only this range.
  std::vector<std::string> unread;
  int first_scene = 0, num_scenes = 0;
  int without_drivers = 0;          // scenes left out because all of their road users are parked or absent
  std::vector<std::string> faults;  // scenes left out because they cannot be read or simulated, with reasons
  std::vector<std::vector<SceneCounts>> counts;  // [densities][scored scenes]

  int scored() const { return counts.empty() ? 0 : static_cast<int>(counts.front().size()); }
  int64_t agent_steps() const;  // steps of driven agents
};

/// One driven road user in one rollout of one scene at one density.
struct SceneAgent {
  std::string scenario_id;
  double density = 1;
  int rollout = 0;
  int64_t track_id = 0;
  TrackType type = TrackType::unset;
  int32_t takeover_step = 0;  // episode step
  int32_t driven_steps = 0;
  int events = 0;  // events of the agent's episode: bits of Event
  bool arrived = false;
  float distance_m = 0;
  // Distance from the recorded positions: mean over the steps that are recorded while the agent drives, and at the last
  // of these steps; NaN without such steps.
  float mean_displacement_m = std::numeric_limits<float>::quiet_NaN(), final_displacement_m = mean_displacement_m;
};

/// Adds a road user to its scene's counts, if it is a vehicle.
void add(const SceneAgent& agent, bool is_vehicle, SceneCounts* counts_inout);

/// Results of one density over vehicle episodes; intervals are over scenes.
struct SceneRow {
  double density = 1;
  int scenes = 0;
  int64_t vehicle_episodes = 0;
  double km_driven = 0;
  Estimate at_fault_collision_rate, off_road_rate, goal_rate;
  Estimate collision_rate;       // at fault or not
  Estimate mean_displacement_m;  // mean over vehicles of SceneAgent::mean_displacement_m
};
SceneRow row_of(double density, const std::vector<SceneCounts>& scenes);
/// Returns a row for each density of the protocol; empty if no scene was scored.
std::vector<SceneRow> rows_of(const SceneResults& results);
/// Metrics of a row with their names in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row);

/// Merges parts, which must have the same setting and protocol, and whose scenes must be contiguous and disjoint.
/// Throws Error naming the parts, by the names given, and the difference.
SceneResults merge(const std::vector<SceneResults>& parts, const std::vector<std::string>& names);

/// Writes and reads one JSON object without loss. read_scene_results() throws Error naming the file and what is
/// missing.
void write_results(const std::string& path, const SceneResults& results);
SceneResults read_scene_results(const std::string& path);
/// Whether the file contains results of recorded scenes, rather than results of towns or other data.
bool has_scene_results(const std::string& path);

/// Lines of a CSV file, each with its newline; the first line names the columns.
std::string scene_agents_csv_head();
std::string csv_line(const SceneAgent& agent);

}  // namespace pictura
