// Results of evaluated vehicles by scenario, the paper's metrics, and mergeable result files.
#pragma once

#include <array>
#include <cmath>
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

// List of standing counts: X(type, name in files). A wait at a red light begins at rest (kRest_mps) with the front at
// most 5 m before the stop line. It ends when the light changes or no longer applies.
#define PICTURA_STANDING_COUNTS(X)                                                         \
  X(int64_t, driven_steps)    /* steps of active vehicles */                               \
  X(int64_t, reversing_steps) /* driven steps at a speed below -kRest_mps, so backwards */ \
  X(int64_t, red_waits)                                                                    \
  X(double, red_wait_moved_m) /* distance moved during waits, forwards or backwards */     \
  X(int64_t, stuck_at_end)    /* vehicles that are active at the last step, with at most 5 m of progress in 60 s */

/// Standing counts of one scenario; 0 in files of earlier versions.
struct StandingCounts {
#define X(type, name) type name = 0;
  PICTURA_STANDING_COUNTS(X)
#undef X
};

/// Counts over the vehicles of one scenario. An event counts once per vehicle. Successive agents in one slot count as
/// separate vehicles.
struct ScenarioCounts {
#define X(type, name) type name = 0;
  PICTURA_SCENARIO_COUNTS(X)
#undef X
  StandingCounts standing;

  void add(const ScenarioCounts& part) {
#define X(type, name) name += part.name;
    PICTURA_SCENARIO_COUNTS(X)
#undef X
#define X(type, name) standing.name += part.standing.name;
    PICTURA_STANDING_COUNTS(X)
#undef X
  }

  /// Calls visit(name in files, count) for all counts.
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

/// Results of consecutive scenarios of one density.
struct DensityResult {
  std::string density;
  int agents_per_world = 0;
  int first_scenario = 0;
  std::vector<ScenarioCounts> scenarios;
  std::string driver;  // as in EvaluateOptions::others; empty: the evaluated driver
  // [scenarios] agent with the most severe infraction; 0 also if there is none. At-fault collisions rank before
  // off-road and red lights. Files lack this field.
  std::vector<int> worst_agents;
};

/// Setting that determines an evaluation's results.
struct EvaluationSetting {
  std::string policy_hash;  // hash of the weights, or the controller's name
  std::vector<std::string> maps;
  // Hashes of the roads (or scene files), and of all cameras' poses and lenses. maps_hash is empty if not requested;
  // cameras_hash is empty without images. Both are empty in files of earlier versions.
  std::string maps_hash, cameras_hash;
  std::map<std::string, std::string> config;  // see keys_of_evaluation(); empty in files of earlier versions
  int steps = 0;
  bool argmax = true;
  uint64_t seed = 0;
  std::string precision, device;                        // network precision; "cpu" or "cuda"
  std::string renderer, samples;                        // empty without images
  std::vector<std::string> image_sizes;                 // "96x54" per camera
  std::string light_heads = "as_mapped";                // see map/map_geometry.h; default of files without the key
  std::array<double, kNumConditioning> conditioning{};  // in the order of simulator/conditioning.h
  LightCycles light_cycles = LightCycles::phases;
  std::vector<std::string> others;  // see MixedTraffic::setting()
  double camera_severity = 0;       // see SessionOptions
  friend bool operator==(const EvaluationSetting&, const EvaluationSetting&) = default;
};

struct EvaluationResults {
  EvaluationSetting setting;
  /// False for files of format 1, which lack collision, wall_contact and any_infraction.
  bool counts_all_collisions = true;
  std::vector<DensityResult> densities;
};

/// Ratio of two sums over scenarios; 95 % confidence interval: value +- half_width_95. The half width follows from the
/// linearised variance between scenarios, and is infinite for one scenario.
struct Estimate {
  double value = 0, half_width_95 = 0;
};

/// `part` belongs to the dividend, `whole` to the divisor.
struct RatioTerm {
  double part = 0, whole = 0;
};
/// Estimates the ratio of the sums; infinite if the divisor is 0.
Estimate estimate_ratio(const std::vector<RatioTerm>& scenarios);
/// Estimates the ratio of the sums of part_of(counts) and whole_of(counts).
template <typename Counts, typename Part, typename Whole>
Estimate estimate_ratio(const std::vector<Counts>& scenarios, const Part& part_of, const Whole& whole_of) {
  std::vector<RatioTerm> terms;
  for (const Counts& counts : scenarios) {
    terms.push_back({static_cast<double>(part_of(counts)), static_cast<double>(whole_of(counts))});
  }
  return estimate_ratio(terms);
}

/// The paper's five metrics (appendix, metric definitions) and further metrics of one density. Uncounted metrics are
/// NaN.
struct EvaluateRow {
  std::string density, driver;
  int scenarios = 0, steps = 0;
  int64_t vehicle_episodes = 0, infractions = 0;  // infractions: vehicles with any_infraction
  Estimate at_fault_collision_rate, off_road_rate, red_light_rate, goals_per_vehicle;
  Estimate km_per_infraction;  // infinite without infractions
  double km_driven = 0;
  Estimate km_per_vehicle, waypoints_per_vehicle, return_per_vehicle;
  Estimate active_at_end_share, never_moved_share;
  Estimate collision_rate, wall_contact_rate;
  Estimate km_per_at_fault_infraction;  // infinite without at-fault infractions
  // For roads that end, which vehicles soon leave.
  Estimate at_fault_collisions_per_km, off_road_per_km, red_lights_per_km, goals_per_km;
  int64_t asked = 0, spawned = 0, entered = 0, left = 0;
  // reversing_share: share of driving time. red_wait_moved_m: mean per wait; NaN without waits. stuck_at_end_share:
  // share of vehicles.
  Estimate reversing_share, red_wait_moved_m, stuck_at_end_share;
  int64_t red_waits = 0;

  /// False for files of an earlier version, which count only infractions at fault.
  bool counts_infractions() const { return !std::isnan(km_per_infraction.value); }
};

/// Returns a row's metrics with their names in files.
std::vector<std::pair<std::string, Estimate>> metrics_of(const EvaluateRow& row);
/// Returns the metrics for roads that end, with their names in files.
std::vector<std::pair<std::string, Estimate>> rates_per_km_of(const EvaluateRow& row);

EvaluateRow row_of(const DensityResult& result, int steps);
std::vector<EvaluateRow> rows_of(const EvaluationResults& results);

/// Merges parts with equal settings. Their scenarios must be disjoint and contiguous for each density. `names`: the
/// parts' names in errors. Throws Error naming two parts and their difference.
EvaluationResults merge(const std::vector<EvaluationResults>& parts, const std::vector<std::string>& names);

/// Writes JSON without loss: format 2, or format 1 if not all collisions are counted.
void write_results(const std::string& path, const EvaluationResults& results);
/// Throws Error naming the file and what is missing.
EvaluationResults read_results(const std::string& path);

}  // namespace pictura
