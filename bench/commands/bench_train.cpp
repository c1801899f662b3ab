// `pictura bench train`: measures whole updates of a configuration: rates, shares, seconds by phase and device memory.
// Also draws figures of rates on several GPUs, which scripts/gpu_ranks measures.
#include <fmt/format.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/bench/commands/measure_training.h"
#include "pictura/bench/commands/plot_results.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/number_options.h"

namespace pictura {

namespace {

struct TrainArguments {
  TrainingCase measured{.config_path = "configs/smoke.toml"};
  SessionOptions backends{.device = "", .simulator = ""};
  bool json = false;
  std::optional<EarlierReport> earlier;
  PlotArguments plot;
};

// Adds the kernels of the profiled update: the time of all kernels and copies, the wall time in which none of them ran,
// and the longest kernels. Kernels run in sequence, on one stream.
void add_kernels(const TrainingMeasurement& measurement, std::vector<BenchResult>* results_inout) {
  double all_s = 0;
  int64_t launches = 0;
  for (const KernelTime& kernel : measurement.kernels) {
    all_s += kernel.seconds;
    launches += kernel.launches;
  }
  const double update_s = wall_s(measurement.profiled);
  results_inout->push_back({"train, kernels of one update", "s", {all_s}});
  results_inout->push_back({"train, launches of one update", "1", {static_cast<double>(launches)}});
  results_inout->push_back({"train, launch overhead", "%", {100 * (update_s - all_s) / update_s}});
  constexpr std::size_t kShown = 40;
  for (std::size_t i = 0; i < std::min(kShown, measurement.kernels.size()); ++i) {
    const KernelTime& kernel = measurement.kernels[i];
    results_inout->push_back(
        {fmt::format("train, kernel, {} x {}", kernel.launches, kernel.name.substr(0, 160)), "s", {kernel.seconds}});
  }
}

void run_train(TrainArguments arguments) {
  if (has_plot_arguments(arguments.plot)) return draw_results("rank_rates", arguments.plot);
  TrainingCase& measured = arguments.measured;
  for (const std::string& text : overrides_of(arguments.backends)) measured.overrides.push_back(text);
  const TrainingMeasurement measurement = measure_training(measured);

  const auto row = [&measurement](const std::string& name, const std::string& unit, auto value) {
    return result_of(measurement, "train, " + name, unit, value);
  };
  std::vector<BenchResult> results{
      row("active agents", "agent_steps_per_s",
          [](const UpdateCost& cost) { return static_cast<double>(cost.agent_steps) / wall_s(cost); }),
      row("slots", "slot_steps_per_s",
          [](const UpdateCost& cost) { return static_cast<double>(cost.slot_steps) / wall_s(cost); }),
      row("live share of slot-steps", "%",
          [](const UpdateCost& cost) {
            return 100 * static_cast<double>(cost.agent_steps) / static_cast<double>(cost.slot_steps);
          }),
      row("kept share of transitions", "%", [](const UpdateCost& cost) { return 100 * cost.kept_fraction; }),
      row("minibatches", "1", [](const UpdateCost& cost) { return static_cast<double>(cost.minibatches); }),
      row("one update", "s", wall_s),
      row("collecting", "s", [](const UpdateCost& cost) { return cost.rollout_s; }),
      row("improving", "s", [](const UpdateCost& cost) { return cost.update_s; })};
  for (std::size_t i = 0; i < kNumPhases; ++i) {
    results.push_back(
        row(std::string("phase ") + kPhaseNames[i], "s", [i](const UpdateCost& cost) { return cost.phases_s[i]; }));
  }
  results.push_back(row("in no phase", "s", other_s));
  if (measurement.report.device_bytes > 0) {
    results.push_back(
        {"train, device memory in use", "GB", {static_cast<double>(measurement.report.device_bytes) / 1e9}});
    results.push_back(
        {"train, peak of tensors", "GB", {static_cast<double>(measurement.report.peak_tensor_bytes) / 1e9}});
  }
  if (measured.profiles_kernels) add_kernels(measurement, &results);
  std::string workload = fmt::format("train: {}", measured.config_path);
  for (const std::string& text : measured.overrides) workload += " --set " + text;
  if (!measured.init_from.empty()) workload += ", weights of " + measured.init_from;
  workload += fmt::format("; whole updates after a warm-up of {}", measured.warm_up);
  report_benchmark(arguments.json, training_context(workload, measurement.report), results, arguments.earlier);
}

}  // namespace

void add_train_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<TrainArguments>();
  TrainingCase& measured = arguments->measured;
  CLI::App* command = bench.add_subcommand("train", "Whole updates of a configuration");
  command->add_option("--config", measured.config_path, "TOML file")->capture_default_str();
  command
      ->add_option("--set", measured.overrides,
                   "Override a key, for instance simulator.num_slots=4096; may be given several times")
      ->allow_extra_args(false);
  add_policy_backend_options(command, "as in the configuration", &arguments->backends);
  command->add_option("--init-from", measured.init_from, "Start with the weights of this checkpoint");
  add_number_option(command, "--warm-up", measured.warm_up, "Updates before the measured updates", 1);
  add_number_option(command, "--updates", measured.updates, "Measured updates, independent of train.updates", 1);
  command->add_flag(
      "--kernels", measured.profiles_kernels,
      "Time each kernel in an additional update: the longest kernels, and the share of wall time without kernels");
  command->add_flag("--json", arguments->json, "Print one JSON object");
  add_compare_option(command, &arguments->earlier);
  add_plot_options(command, "Plot rates of scripts/gpu_ranks from its files instead of measuring", &arguments->plot);
  command->footer(
      "Examples:\n  pictura bench train --updates 5\n"
      "  pictura bench train --config configs/smoke.toml --json\n"
      "  pictura bench train --plot bench/results/gpu_ranks.json --figure ranks.png\n"
      "  pictura bench train --config configs/paper.toml --set train.forward_chunk=8192 --init-from policy.ckpt "
      "--json");
  command->callback([arguments, command] {
    if (!has_plot_arguments(arguments->plot)) check_default_config(*command, arguments->measured.config_path);
    run_train(*arguments);
  });
}

}  // namespace pictura
