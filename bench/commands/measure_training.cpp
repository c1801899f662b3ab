#include "pictura/bench/commands/measure_training.h"

#include <filesystem>
#include <numeric>

#include <unistd.h>

#ifdef PICTURA_HAS_BENCH
#include "pictura/bench/render.h"
#endif
#include "pictura/common/error.h"

namespace pictura {

namespace {

// Bound on the KL divergence of the unchanged policy. With bf16 arithmetic, the divergence is a hundred times smaller;
// with wrong images or observations, it is far larger.
constexpr double kMaxFirstKl = 0.01;

// A folder that is removed with all its files.
struct TemporaryFolder {
  const std::string path = std::filesystem::temp_directory_path() / fmt::format("pictura-bench-{}", getpid());
  TemporaryFolder() = default;
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

void check_update(const TrainProgress& progress) {
  const UpdateCost& cost = progress.cost;
  PICTURA_CHECK(cost.agent_steps > 0 && cost.minibatches > 0,
                "bench: update {}: expected agent-steps and minibatches, got {} and {}", progress.update,
                cost.agent_steps, cost.minibatches);
  PICTURA_CHECK(cost.first_kl <= kMaxFirstKl,
                "bench: update {}: expected the probabilities of the rollout while parameters are those of the "
                "rollout, got a KL divergence of {} (at most {})",
                progress.update, cost.first_kl, kMaxFirstKl);
}

}  // namespace

void check_default_config(const CLI::App& command, const std::string& path) {
  if (command.count("--config") > 0 || std::filesystem::exists(path)) return;
  fail_usage("--config: the default, {}, exists only in the root of the repository: expected a TOML file", path);
}

TrainingMeasurement measure_training(const TrainingCase& training_case) {
  const TemporaryFolder folder;
  TrainingMeasurement result;
  TrainOptions options{.config_path = training_case.config_path,
                       .overrides = training_case.overrides,
                       .out_folder = folder.path,
                       .old_run = OldRun::overwrite,
                       .init_from = training_case.init_from};
  const int profiled = training_case.warm_up + training_case.updates + 1,
            updates = training_case.profiles_kernels ? profiled : profiled - 1;
  for (const std::string& text : {fmt::format("train.updates={}", updates), std::string("train.schedule=constant"),
                                  fmt::format("train.checkpoint_every={}", updates)}) {
    options.overrides.push_back(text);
  }
  options.on_progress = [&](const TrainProgress& progress) {
    check_update(progress);
    if (progress.update == profiled) {
      result.profiled = progress.cost;
      result.kernels = KernelProfile::end();
    } else if (progress.update > training_case.warm_up) {
      result.updates.push_back(progress.cost);
    }
    if (progress.update + 1 == updates && training_case.profiles_kernels) KernelProfile::begin();
  };
  result.report = train(options);
  if (result.report.interrupted) throw Interrupted("interrupted");
  return result;
}

double wall_s(const UpdateCost& cost) { return cost.rollout_s + cost.update_s; }

double other_s(const UpdateCost& cost) {
  return wall_s(cost) - std::accumulate(cost.phases_s.begin(), cost.phases_s.end(), 0.0);
}

BenchContext training_context(const std::string& workload, const TrainReport& report) {
  BenchContext context{.workload = workload,
                       .backend = fmt::format("simulator {}, renderer {}, learning on {}", report.simulator,
                                              report.renderer.empty() ? "none" : report.renderer, report.device)};
#ifdef PICTURA_HAS_BENCH
  if (report.device.starts_with("cuda")) context.add_gpu(cuda_device_name(), cuda_driver_name());
#endif
  return context;
}

}  // namespace pictura
