// Shared by `pictura bench train` and `pictura bench breakdown`: updates of a configuration and what each of them cost.
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
  std::string init_from;  // a checkpoint, or empty
  int warm_up = 1, updates = 3;
  bool profiles_kernels = false;  // in one update more
};

struct TrainingMeasurement {
  std::vector<UpdateCost> updates;  // after the warm-up
  UpdateCost profiled;              // the update in which kernels were timed, and their times
  std::vector<KernelTime> kernels;
  TrainReport report;
};

/// Trains in a temporary folder. The learning rate stays constant, so that no schedule ends. Throws Error where an
/// update took no agent-step or no minibatch, or where, before its parameters change, the policy gives actions other
/// probabilities than in the rollout: then it was not shown what the agents saw. Throws what train() throws.
TrainingMeasurement measure_training(const TrainingCase& training_case);

/// Wall time of an update, and what of it is in no phase.
double wall_s(const UpdateCost& cost);
double other_s(const UpdateCost& cost);
inline double phase_s(const UpdateCost& cost, Phase phase) { return cost.phases_s[static_cast<size_t>(phase)]; }

/// One value of each update.
template <typename Value>
BenchResult result_of(const TrainingMeasurement& measurement, const std::string& name, const std::string& unit,
                      const Value& value) {
  BenchResult result{name, unit, {}};
  for (const UpdateCost& cost : measurement.updates) result.values.push_back(value(cost));
  return result;
}

/// Device and driver of a training run; backend names what simulated, drew and learnt.
BenchContext training_context(const std::string& workload, const TrainReport& report);

}  // namespace pictura
