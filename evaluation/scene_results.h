// Results in recorded scenes, and mergeable result files.
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
#define PICTURA_SCENE_COUNTS(X)                                             \
  X(int64_t, vehicles)                                                      \
  X(int64_t, at_fault)                                                      \
  X(int64_t, collision)                                                     \
  X(int64_t, off_road)                                                      \
  X(int64_t, goals)         /* vehicles that arrived */                     \
  X(int64_t, infractions)   /* vehicles at fault or off the road */         \
  X(int64_t, measured)      /* vehicles with a known displacement */        \
  X(double, displacement_m) /* sum of these vehicles' mean displacements */ \
  X(double, distance_m)                                                     \
  X(int64_t, driven_steps) /* steps of all driven road users */

/// Counts over the driven vehicles of all rollouts of one scene and density. An event counts once per vehicle and
/// rollout.
struct SceneCounts {
#define X(type, name) type name = 0;
  PICTURA_SCENE_COUNTS(X)
#undef X

  /// Calls visit(name in files, count) for all counts.
  template <typename Counts, typename Visit>
  static void visit(Counts& counts, const Visit& visit) {
#define X(type, name) visit(#name, counts.name);
    PICTURA_SCENE_COUNTS(X)
#undef X
  }
};

struct SceneResults {
  EvaluationSetting setting;  // `maps` holds SceneEvaluateOptions::scenes
  SceneProtocol protocol;
  // Reasons why files, or files from some record on, cannot be read; also for files outside the range of scenes.
  std::vector<std::string> unread;
  int first_scene = 0, num_scenes = 0;
  int without_drivers = 0;                       // excluded: all road users are parked or absent
  int repaired_headings = 0;                     // in scored scenes; see SceneProtocol::max_first_turn_deg
  std::vector<std::string> faults;               // excluded scenes that cannot be read or simulated
  std::vector<std::vector<SceneCounts>> counts;  // [densities][scored scenes]

  int scored() const { return counts.empty() ? 0 : static_cast<int>(counts.front().size()); }
  int64_t agent_steps() const;  // driven agents only
};

/// A driven road user in one rollout.
struct SceneAgent {
  std::string scenario_id;
  double density = 1;
  int rollout = 0;
  int64_t track_id = 0;
  TrackType type = TrackType::unset;
  int32_t takeover_step = 0;  // episode step
  int32_t driven_steps = 0;
  int events = 0;  // bits of Event
  bool arrived = false;
  float distance_m = 0;
  // Distance between driven and recorded position: mean over driven steps with a recorded position, and last value. NaN
  // without such steps.
  float mean_displacement_m = std::numeric_limits<float>::quiet_NaN(), final_displacement_m = mean_displacement_m;
};

/// Adds a road user to its scene's counts; non-vehicles add only driven steps.
void add(const SceneAgent& agent, bool is_vehicle, SceneCounts* counts_inout);

/// Results of one density; confidence intervals are over scenes.
struct SceneRow {
  double density = 1;
  int scenes = 0;
  int64_t vehicle_episodes = 0;
  double km_driven = 0;
  Estimate at_fault_collision_rate, off_road_rate, goal_rate;
  Estimate collision_rate;       // at fault or not
  Estimate mean_displacement_m;  // mean over vehicles
};
SceneRow row_of(double density, const std::vector<SceneCounts>& scenes);
/// Returns one row per density; empty if no scene was scored.
std::vector<SceneRow> rows_of(const SceneResults& results);
/// Returns a row's metrics with their names in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row);

/// Merges as merge() of results.h does. The parts also need equal protocols.
SceneResults merge(const std::vector<SceneResults>& parts, const std::vector<std::string>& names);

/// Write and read JSON without loss. read_scene_results() throws Error naming the file and what is missing.
void write_results(const std::string& path, const SceneResults& results);
SceneResults read_scene_results(const std::string& path);
/// False for results of towns and for other data.
bool has_scene_results(const std::string& path);

/// Return lines of the CSV file of road users, with newlines.
std::string scene_agents_csv_head();
std::string csv_line(const SceneAgent& agent);

}  // namespace pictura
