// What evaluated vehicles did in recorded scenes: by road user, by scene, and the figures over all of them. Without
// torch headers.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pictura/map/scenario/scenario.h"
#include "pictura/training/evaluation/results.h"

namespace pictura {

/// Of the driven vehicles of one scene at one density.
struct SceneCounts {
  int64_t vehicles = 0;
  int64_t at_fault = 0, collision = 0, off_road = 0;  // that did so at least once
  int64_t goals = 0;                                  // that arrived
  int64_t infractions = 0;                            // that were at fault or off the road
  int64_t measured = 0;                               // whose displacement is known
  double displacement_m = 0;                          // sum of their means
  double distance_m = 0;
};

/// One driven road user in one scene at one density.
struct SceneAgent {
  std::string scenario_id;
  double density = 1;
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
/// Its metrics with the names that they have in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row);

/// A line of a CSV file each, with its newline; the first names the columns.
std::string scene_agents_csv_head();
std::string csv_line(const SceneAgent& agent);

}  // namespace pictura
