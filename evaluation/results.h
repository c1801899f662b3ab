// What evaluated vehicles did, by scenario; the paper's metrics over them; and the file by which parts of an evaluation
// are merged. Without torch headers.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/rule_choices.h"

namespace pictura {

// X(type, name in files).
#define PICTURA_SCENARIO_COUNTS(X)                                                                                     \
  X(int64_t, vehicles)                                                                                                 \
  X(int64_t, collision) /* at fault or not */                                                                          \
  X(int64_t, at_fault)  /* collisions at fault alone */                                                                \
  X(int64_t, off_road)                                                                                                 \
  X(int64_t, red_light)                                                                                                \
  X(int64_t, wall_contact)   /* belongs to neither kind of infraction below */                                         \
  X(int64_t, any_infraction) /* a collision, off-road or a red light: the paper's (appendix, metric definitions) */    \
  X(int64_t, at_fault_infraction) /* a collision at fault, off-road or a red light */                                  \
  X(int64_t, active_at_end)       /* vehicles that have not halted by the last step, or before they left */            \
  X(int64_t, never_moved)         /* vehicles that stayed at rest (kRest_mps); 0 in files of earlier versions */       \
  X(int64_t, goals)                                                                                                    \
  X(int64_t, waypoints)                                                                                                \
  X(double, distance_m)                                                                                                \
  X(double, returns)                                                                                                   \
  X(int64_t, asked) /* as the three below of agents of all classes, see SpawnReport; 0 in files of earlier versions */ \
  X(int64_t, spawned)                                                                                                  \
  X(int64_t, entered)                                                                                                  \
  X(int64_t, left)

// Likewise. Waits at red lights are from a step in which the bumper is at most 5 m before the line, at rest
// (kRest_mps), to the light's change or the vehicle's.
#define PICTURA_STANDING_COUNTS(X)                                               \
  X(int64_t, driven_steps)    /* of active vehicles */                           \
  X(int64_t, reversing_steps) /* of those, backwards, not at rest (kRest_mps) */ \
  X(int64_t, red_waits)                                                          \
  X(double, red_wait_moved_m) /* forwards or backwards */                        \
  X(int64_t, stuck_at_end)    /* active in the last step, and not 5 m on for 60 s */

/// How the vehicles of one scenario stand and go backwards. 0 in files of earlier versions.
struct StandingCounts {
#define X(type, name) type name = 0;
  PICTURA_STANDING_COUNTS(X)
#undef X
};

/// Counts over the vehicles of one scenario; on roads that end, over their lives, each of which counts as a vehicle. An
/// event counts once a vehicle, however often it happens.
struct ScenarioCounts {
#define X(type, name) type name = 0;
  PICTURA_SCENARIO_COUNTS(X)
#undef X
  StandingCounts standing;

  /// Calls visit(name in files, count) for all counts of `counts`, a ScenarioCounts.
  template <typename Counts, typename Visit>
  static void visit(Counts& counts, const Visit& visit) {
#define X(type, name) visit(#name, counts.name);
    PICTURA_SCENARIO_COUNTS(X)
#undef X
#define X(type, name) visit(#name, counts.standing.name);
    PICTURA_STANDING_COUNTS(X)
#undef X
  }
};

/// The scenarios first, first + 1, ... of one density.
struct DensityResult {
  std::string density;
  int agents_per_world = 0;
  int first_scenario = 0;
  std::vector<ScenarioCounts> scenarios;
  std::string driver;  // whose vehicles: one of EvaluateOptions::others; empty: the evaluated driver's
  // The agent with the gravest infraction of each scenario: a collision at fault, else off-road, else a red light; else
  // agent 0. Not in files.
  std::vector<int> worst_agents;
};

/// What decides an evaluation's numbers. Parts are merged where all of it is the same.
struct EvaluationSetting {
  std::string policy_hash;  // of the weights; a controller's name
  std::vector<std::string> maps;
  // Of the maps' roads, of the bytes of recorded scenes' files, and of the poses and lenses of all cameras. Empty in
  // files of earlier versions, and where nobody asked for it.
  std::string maps_hash, cameras_hash;
  std::map<std::string, std::string> config;  // see keys_of_evaluation(); empty in files of earlier versions
  int steps = 0;
  bool argmax = true;
  uint64_t seed = 0;
  std::string precision, device;                        // of the network; "cpu" or "cuda"
  std::string renderer, samples;                        // empty for policies without images
  std::vector<std::string> image_sizes;                 // "96x54", of each camera
  std::string light_heads = "as_mapped";                // see map/map_geometry.h; files without it have this one
  std::array<double, kNumConditioning> conditioning{};  // of every agent, in the order of simulator/conditioning.h
  LightCycles light_cycles = LightCycles::phases;
  std::vector<std::string> others;  // who else drives, see MixedTraffic::setting()
  double camera_severity = 0;       // of randomized cameras (SessionOptions)
  friend bool operator==(const EvaluationSetting&, const EvaluationSetting&) = default;
};

struct EvaluationResults {
  EvaluationSetting setting;
  /// False for files of format 1, which lack collision, wall_contact and any_infraction.
  bool counts_all_collisions = true;
  std::vector<DensityResult> densities;
};

/// A ratio of sums over scenarios. 95 % of such intervals, value +- half_width_95, hold the ratio over all scenarios
/// that could be drawn, by the linearised variance between scenarios; infinite for one scenario.
struct Estimate {
  double value = 0, half_width_95 = 0;
};

/// What a scenario adds to the sums of a ratio.
struct RatioTerm {
  double part = 0, whole = 0;
};
/// Infinite where there is nothing to divide by. A mean of one number a scenario is the ratio with wholes of 1.
Estimate estimate_ratio(const std::vector<RatioTerm>& scenarios);
/// Of the parts and wholes of what was counted in each scenario.
template <typename Counts, typename Part, typename Whole>
Estimate estimate_ratio(const std::vector<Counts>& scenarios, const Part& part_of, const Whole& whole_of) {
  std::vector<RatioTerm> terms;
  for (const Counts& counts : scenarios) {
    terms.push_back({static_cast<double>(part_of(counts)), static_cast<double>(whole_of(counts))});
  }
  return estimate_ratio(terms);
}

/// The paper's five metrics (appendix, metric definitions) over the vehicles of one density, and more. Metrics of what
/// was not counted are NaN.
struct EvaluateRow {
  std::string density, driver;  // as DensityResult's
  int scenarios = 0, steps = 0;
  int64_t vehicle_episodes = 0, infractions = 0;  // the second: vehicles with any_infraction
  Estimate at_fault_collision_rate, off_road_rate, red_light_rate, goals_per_vehicle;
  Estimate km_per_infraction;  // over vehicles with any_infraction; infinite when there was none
  double km_driven = 0;
  Estimate km_per_vehicle, waypoints_per_vehicle, return_per_vehicle;
  Estimate active_at_end_share, never_moved_share;
  Estimate collision_rate, wall_contact_rate;
  Estimate km_per_at_fault_infraction;  // over vehicles with at_fault_infraction; infinite when there was none
  // Per km, since lives on roads that end are short.
  Estimate at_fault_collisions_per_km, off_road_per_km, red_lights_per_km, goals_per_km;
  int64_t asked = 0, spawned = 0, entered = 0, left = 0;
  // See StandingCounts: of the time that vehicles drive; of a wait; of vehicles. The second is NaN without any wait.
  Estimate reversing_share, red_wait_moved_m, stuck_at_end_share;
  int64_t red_waits = 0;
};

/// Its metrics with the names that they have in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const EvaluateRow& row);

EvaluateRow row_of(const DensityResult& result, int steps);
/// Returns one row a density, in the order of the results.
std::vector<EvaluateRow> rows_of(const EvaluationResults& results);

/// Joins the parts of each density, which must be of one setting and together scenarios without gap or overlap. The
/// result counts all collisions where every part does. Throws Error naming the parts, by the names given, and what
/// differs.
EvaluationResults merge(const std::vector<EvaluationResults>& parts, const std::vector<std::string>& names);

/// Writes the results as one JSON object, exactly: of format 2, or of format 1 where not all collisions are counted.
void write_results(const std::string& path, const EvaluationResults& results);
/// Reads files of both formats. Throws Error naming the file and what it lacks.
EvaluationResults read_results(const std::string& path);

}  // namespace pictura
