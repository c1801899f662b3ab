// Results of evaluated vehicles by scenario, the paper's metrics of these results, and files from which parts of an
// evaluation are merged. Includes no torch headers.
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

// List of counts: X(type, name in files).
#define PICTURA_SCENARIO_COUNTS(X)                                                                                 \
  X(int64_t, vehicles)                                                                                             \
  X(int64_t, collision) /* at fault or not */                                                                      \
  X(int64_t, at_fault)  /* collisions at fault only */                                                             \
  X(int64_t, off_road)                                                                                             \
  X(int64_t, red_light)                                                                                            \
  X(int64_t, wall_contact)        /* counted neither in any_infraction nor in at_fault_infraction */               \
  X(int64_t, any_infraction)      /* a collision, off-road or a red light (paper, appendix, metric definitions) */ \
  X(int64_t, at_fault_infraction) /* a collision at fault, off-road or a red light */                              \
  X(int64_t, active_at_end)       /* vehicles that did not halt */                                                 \
  X(int64_t, never_moved)         /* vehicles that stayed at rest (kRest_mps); 0 in files of earlier versions */   \
  X(int64_t, goals)                                                                                                \
  X(int64_t, waypoints)                                                                                            \
  X(double, distance_m)                                                                                            \
  X(double, returns)                                                                                               \
  X(int64_t, asked) /* from here on: agents of all classes (SpawnReport); 0 in files of earlier versions */        \
  X(int64_t, spawned)                                                                                              \
  X(int64_t, entered)                                                                                              \
  X(int64_t, left)

// List of standing counts: X(type, name in files). A wait at a red light begins at a step in which the vehicle is at
// rest (kRest_mps) with its front bumper at most 5 m before the stop line. The wait ends when the light changes or no
// longer applies to the vehicle.
#define PICTURA_STANDING_COUNTS(X)                                                         \
  X(int64_t, driven_steps)    /* steps of active vehicles */                               \
  X(int64_t, reversing_steps) /* driven steps at a speed below -kRest_mps, so backwards */ \
  X(int64_t, red_waits)                                                                    \
  X(double, red_wait_moved_m) /* distance moved during waits, forwards or backwards */     \
  X(int64_t, stuck_at_end)    /* vehicles that are active at the last step, with at most 5 m of progress in 60 s */

/// Counts of standing and reversing by the vehicles of one scenario. All are 0 in files of earlier versions.
struct StandingCounts {
#define X(type, name) type name = 0;
  PICTURA_STANDING_COUNTS(X)
#undef X
};

/// Counts over the vehicles of one scenario. On roads that end, an agent's slot is reused after the agent leaves; each
/// agent in turn counts as a vehicle. An event counts once per vehicle, however often it happens.
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

/// Results of the scenarios first_scenario, first_scenario + 1, ... of one density.
struct DensityResult {
  std::string density;
  int agents_per_world = 0;
  int first_scenario = 0;
  std::vector<ScenarioCounts> scenarios;
  std::string driver;  // driver of the vehicles: one of EvaluateOptions::others; empty: the evaluated driver
  // [scenarios] agent with the scenario's most severe infraction; 0 without infractions. A collision at fault is most
  // severe, then off-road, then a red light. Files do not contain this field.
  std::vector<int> worst_agents;
};

/// Setting that determines the results of an evaluation. Parts can be merged if their settings are equal.
struct EvaluationSetting {
  std::string policy_hash;  // hash of the policy's weights, or the controller's name
  std::vector<std::string> maps;
  // maps_hash: hash of the maps' roads, or of the bytes of recorded scenes' files. cameras_hash: hash of the poses and
  // lenses of all cameras. Both are empty in files of earlier versions. maps_hash is empty if not requested;
  // cameras_hash is empty without images.
  std::string maps_hash, cameras_hash;
  std::map<std::string, std::string> config;  // see keys_of_evaluation(); empty in files of earlier versions
  int steps = 0;
  bool argmax = true;
  uint64_t seed = 0;
  std::string precision, device;          // precision of the network; "cpu" or "cuda"
  std::string renderer, samples;          // empty for policies without images
  std::vector<std::string> image_sizes;   // "96x54", one per camera
  std::string light_heads = "as_mapped";  // see map/map_geometry.h; this default holds for files without the key
  std::array<double, kNumConditioning> conditioning{};  // same for all agents, in the order of simulator/conditioning.h
  LightCycles light_cycles = LightCycles::phases;
  std::vector<std::string> others;  // other drivers, see MixedTraffic::setting()
  double camera_severity = 0;       // severity of randomized cameras (SessionOptions)
  friend bool operator==(const EvaluationSetting&, const EvaluationSetting&) = default;
};

struct EvaluationResults {
  EvaluationSetting setting;
  /// Whether all counts are present; false for files of format 1, which lack collision, wall_contact and
  /// any_infraction.
  bool counts_all_collisions = true;
  std::vector<DensityResult> densities;
};

/// Ratio of two sums over scenarios, with its 95 % confidence interval: value +- half_width_95. The interval is for the
/// ratio over all scenarios that could be drawn. Its half width follows from the linearised variance between scenarios;
/// it is infinite for one scenario.
struct Estimate {
  double value = 0, half_width_95 = 0;
};

/// Terms of one scenario in the two sums of a ratio: `part` in the dividend, `whole` in the divisor.
struct RatioTerm {
  double part = 0, whole = 0;
};
/// Estimates the ratio of the sums; infinite if the divisor is 0. If `whole` is 1 in every term, the ratio is the mean
/// of `part` over scenarios.
Estimate estimate_ratio(const std::vector<RatioTerm>& scenarios);
/// Estimates the ratio of the sums over scenarios of part_of(counts) and whole_of(counts).
template <typename Counts, typename Part, typename Whole>
Estimate estimate_ratio(const std::vector<Counts>& scenarios, const Part& part_of, const Whole& whole_of) {
  std::vector<RatioTerm> terms;
  for (const Counts& counts : scenarios) {
    terms.push_back({static_cast<double>(part_of(counts)), static_cast<double>(whole_of(counts))});
  }
  return estimate_ratio(terms);
}

/// The paper's five metrics (appendix, metric definitions) over the vehicles of one density, and further metrics.
/// Metrics that were not counted are NaN.
struct EvaluateRow {
  std::string density, driver;  // as in DensityResult
  int scenarios = 0, steps = 0;
  int64_t vehicle_episodes = 0, infractions = 0;  // infractions: vehicles with any_infraction
  Estimate at_fault_collision_rate, off_road_rate, red_light_rate, goals_per_vehicle;
  Estimate km_per_infraction;  // km_driven per vehicle with any_infraction; infinite without such vehicles
  double km_driven = 0;
  Estimate km_per_vehicle, waypoints_per_vehicle, return_per_vehicle;
  Estimate active_at_end_share, never_moved_share;
  Estimate collision_rate, wall_contact_rate;
  Estimate km_per_at_fault_infraction;  // km_driven per vehicle with at_fault_infraction; infinite if none has one
  // Rates per km, for roads that end: vehicles leave them after a short distance.
  Estimate at_fault_collisions_per_km, off_road_per_km, red_lights_per_km, goals_per_km;
  int64_t asked = 0, spawned = 0, entered = 0, left = 0;
  // From StandingCounts. reversing_share: fraction of driving time. red_wait_moved_m: mean per wait, NaN without waits.
  // stuck_at_end_share: fraction of vehicles.
  Estimate reversing_share, red_wait_moved_m, stuck_at_end_share;
  int64_t red_waits = 0;
};

/// Returns the metrics of a row, with their names in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const EvaluateRow& row);

EvaluateRow row_of(const DensityResult& result, int steps);
/// Returns one row for each result, in the order of the results.
std::vector<EvaluateRow> rows_of(const EvaluationResults& results);

/// Merges parts of an evaluation. The parts must have equal settings. For each density, their scenarios must be
/// disjoint and together contiguous. The result counts all collisions if every part does. `names`: names of the parts
/// in errors. Throws Error naming two parts and their difference.
EvaluationResults merge(const std::vector<EvaluationResults>& parts, const std::vector<std::string>& names);

/// Writes the results as one JSON object without loss: in format 2, or in format 1 if not all collisions are counted.
void write_results(const std::string& path, const EvaluationResults& results);
/// Reads files of both formats. Throws Error naming the file and what is missing.
EvaluationResults read_results(const std::string& path);

}  // namespace pictura
