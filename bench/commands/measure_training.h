// Measurement of some updates of a training run.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

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
  UpdateCost profiled;              // additional update
  std::vector<KernelTime> kernels;
  TrainReport report;
};

/// Throws UsageError if --config was not given and its default `path`, which is relative to the repository's root, does
/// not exist.
void check_default_config(const CLI::App& command, const std::string& path);

/// Trains in a temporary folder, at a constant learning rate. Throws Error if an update took no agent-step or no
/// minibatch. Throws Error if the unchanged policy's action probabilities differ between rollout and learning. Throws
/// the exceptions of train().
TrainingMeasurement measure_training(const TrainingCase& training_case);

/// Wall time of an update, and its part outside all phases, in seconds.
double wall_s(const UpdateCost& cost);
double other_s(const UpdateCost& cost);
inline double phase_s(const UpdateCost& cost, Phase phase) { return cost.phases_s[static_cast<size_t>(phase)]; }

/// One value per update.
template <typename Value>
BenchResult result_of(const TrainingMeasurement& measurement, const std::string& name, const std::string& unit,
                      const Value& value) {
  BenchResult result{name, unit, {}};
  for (const UpdateCost& cost : measurement.updates) result.values.push_back(value(cost));
  return result;
}

/// The result's `backend` names the simulator, the renderer and the learner.
BenchContext training_context(const std::string& workload, const TrainReport& report);

}  // namespace pictura
