// Code that `pictura bench train` and `pictura bench breakdown` share: trains some updates of a configuration and
// measures their costs.
#pragma once

#include <string>
#include <vector>

#include "pictura/bench/commands/bench.h"
#include "pictura/training/kernel_profile.h"
#include "pictura/training/loop.h"

namespace pictura {

struct TrainingCase {
  std::string config_path;
  std::vector<std::string> overrides;
  std::string init_from;  // path of a checkpoint, or empty
  int warm_up = 1, updates = 3;
  bool profiles_kernels = false;  // in one additional update
};

struct TrainingMeasurement {
  std::vector<UpdateCost> updates;  // after the warm-up
  UpdateCost profiled;              // the additional update, in which `kernels` were timed
  std::vector<KernelTime> kernels;
  TrainReport report;
};

/// Trains in a temporary folder. The learning rate stays constant, so that no schedule ends. Throws Error if an update
/// took no agent-step or no minibatch. Throws Error if the unchanged policy computes different probabilities of actions
/// in learning than in the rollout, because its observations are then wrong. Throws the exceptions of train().
TrainingMeasurement measure_training(const TrainingCase& training_case);

/// Wall time of an update in seconds, and the part of it that is outside all phases.
double wall_s(const UpdateCost& cost);
double other_s(const UpdateCost& cost);
inline double phase_s(const UpdateCost& cost, Phase phase) { return cost.phases_s[static_cast<size_t>(phase)]; }

/// Returns one value per update.
template <typename Value>
BenchResult result_of(const TrainingMeasurement& measurement, const std::string& name, const std::string& unit,
                      const Value& value) {
  BenchResult result{name, unit, {}};
  for (const UpdateCost& cost : measurement.updates) result.values.push_back(value(cost));
  return result;
}

/// Returns the device and driver of a training run; `backend` names the simulator, the renderer and the learner.
BenchContext training_context(const std::string& workload, const TrainReport& report);

}  // namespace pictura
