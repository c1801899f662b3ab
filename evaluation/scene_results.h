// What evaluated vehicles did in recorded scenes: by road user, by scene, and the figures over all of them; and the
// file by which parts of an evaluation are merged. Without torch headers.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"
#include "pictura/evaluation/scene_protocol.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

// X(type, name in files).
#define PICTURA_SCENE_COUNTS(X)                                      \
  X(int64_t, vehicles)                                               \
  X(int64_t, at_fault)                                               \
  X(int64_t, collision)                                              \
  X(int64_t, off_road)                                               \
  X(int64_t, goals)         /* that arrived */                       \
  X(int64_t, infractions)   /* that were at fault or off the road */ \
  X(int64_t, measured)      /* whose displacement is known */        \
  X(double, displacement_m) /* sum of their means */                 \
  X(double, distance_m)                                              \
  X(int64_t, driven_steps) /* of all driven road users */

/// Of the driven vehicles of all rollouts of one scene at one density. Those with an event had it once or more.
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

/// What an evaluation counted in the scenes first_scene, first_scene + 1, ... of all that its setting names.
struct SceneResults {
  EvaluationSetting setting;  // its maps are where the scenes are
  SceneProtocol protocol;
  std::vector<std::string> unread;  // files, and ends of files, that are no scenes, of all; and why
  int first_scene = 0, num_scenes = 0;
  int without_drivers = 0;          // left out: nobody whom the protocol would drive, since all are parked or not there
  std::vector<std::string> faults;  // left out: scenes that cannot be read or simulated, and why
  std::vector<std::vector<SceneCounts>> counts;  // [densities][scored scenes]

  int scored() const { return counts.empty() ? 0 : static_cast<int>(counts.front().size()); }
  int64_t agent_steps() const;  // of driven agents
};

/// One driven road user in one rollout of one scene at one density.
struct SceneAgent {
  std::string scenario_id;
  double density = 1;
  int rollout = 0;
  int64_t track_id = 0;
  TrackType type = TrackType::unset;
  int32_t takeover_step = 0;  // of the episode
  int32_t driven_steps = 0;
  int events = 0;  // of its episode: bits of Event
  bool arrived = false;
  float distance_m = 0;
  // From the recording, over the steps that it has while the agent drives, and at the last of them; NaN without one.
  float mean_displacement_m = std::numeric_limits<float>::quiet_NaN(), final_displacement_m = mean_displacement_m;
};

/// Adds a road user to what its scene counts, if it is a vehicle.
void add(const SceneAgent& agent, bool is_vehicle, SceneCounts* counts_inout);

/// The figures of one density over vehicle episodes; intervals are over scenes.
struct SceneRow {
  double density = 1;
  int scenes = 0;
  int64_t vehicle_episodes = 0;
  double km_driven = 0;
  Estimate at_fault_collision_rate, off_road_rate, goal_rate;
  Estimate collision_rate;       // of any fault
  Estimate mean_displacement_m;  // of vehicles, each with its mean
};
SceneRow row_of(double density, const std::vector<SceneCounts>& scenes);
/// By the densities of the protocol; none where no scene was scored.
std::vector<SceneRow> rows_of(const SceneResults& results);
/// Its metrics with the names that they have in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row);

/// Joins parts, which must be of one setting and protocol and together scenes without gap or overlap. Throws Error
/// naming the parts, by the names given, and what differs.
SceneResults merge(const std::vector<SceneResults>& parts, const std::vector<std::string>& names);

/// As one JSON object, exactly. read_scene_results throws Error naming the file and what it lacks.
void write_results(const std::string& path, const SceneResults& results);
SceneResults read_scene_results(const std::string& path);
/// Whether the file says that it is of scenes, rather than of towns or nothing of the kind.
bool has_scene_results(const std::string& path);

/// A line of a CSV file each, with its newline; the first names the columns.
std::string scene_agents_csv_head();
std::string csv_line(const SceneAgent& agent);

}  // namespace pictura
