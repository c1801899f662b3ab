#include "pictura/cli/evaluation_options.h"

#include "pictura/cli/backend_options.h"
#include "pictura/cli/map_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/configuration/config.h"
#include "pictura/driving/world.h"

namespace pictura {

CLI::Option* add_evaluation_options(CLI::App* command, EvaluateOptions* options_out) {
  EvaluateOptions& options = *options_out;
  options.maps = Config().simulator.maps;
  add_map_list_option(command, &options.maps,
                      "Maps of the scenarios, separated by commas; procedural:1-64 means one town for each seed");
  add_number_option(command, "--agents", options.agents_per_world,
                    "Number of agents per world, instead of the numbers of the densities", 1, kMaxAgentsPerWorld);
  add_number_option(command, "--steps", options.steps, "Steps of 0.1 s per scenario", 1);
  CLI::Option* const sampled = add_sampled_option(command, &options.argmax);
  add_seed_option(command, &options.seed, "Seed of the scenarios");
  add_policy_backend_options(command, "auto (renderer: as in training)", &options);
  command
      ->add_option("--conditioning", options.conditioning,
                   "Value that replaces one of the configuration's [evaluate.conditioning] for every agent, for "
                   "instance collision=1; may be given several times")
      ->allow_extra_args(false);
  add_light_cycles_option(command, &options.light_cycles, "as in training");
  add_light_heads_option(command, &options.light_heads);
  add_threads_option(command, &options.num_threads);
  return sampled;
}

CLI::Option* add_sampled_option(CLI::App* command, bool* argmax_out) {
  return command->add_flag_function(
      "--sampled", [argmax_out](int64_t) { *argmax_out = false; },
      "Sample actions from the policy instead of using the most likely action");
}

CLI::Option* add_average_option(CLI::App* command, bool* average_out) {
  return command->add_flag(
      "--average", *average_out,
      "Use the average of the weights (train.weight_average) instead of the weights after the last update");
}

void EvaluationProgress::update(double done, double eta_s) {
  // After a few seconds, which allow an estimate, prints the notice about a long evaluation.
  constexpr double kEstimateAfter_s = 5, kLong_s = 600;
  const double elapsed_s = since_start_.seconds();
  if (!has_estimate_ && elapsed_s >= kEstimateAfter_s) {
    has_estimate_ = true;
    if (elapsed_s + eta_s > kLong_s) {
      line_.finish();
      print_message("notice: this takes at most {}; ^C reports {}, and {}\n", format_duration(elapsed_s + eta_s),
                    finished_, shorter_);
    }
  }
  line_.update(fmt::format("evaluating: {:.0f} %  ETA {}", 100 * done, format_duration(eta_s)));
}

Json driver_json(const DriverOptions& options, const EvaluationSetting& setting) {
  const auto text_or_null = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  return {{"checkpoint", text_or_null(options.checkpoint)},
          {"controller", text_or_null(options.controller)},
          {"policy_hash", setting.policy_hash},
          {"argmax", setting.argmax},
          {"seed", setting.seed},
          {"light_heads", setting.light_heads},
          {"device", setting.device},
          {"precision", setting.precision}};
}

}  // namespace pictura
