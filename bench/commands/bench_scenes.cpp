// `pictura bench scenes`: measures how many recorded scenes an evaluation protocol evaluates per minute, including the
// loading of the scenes.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/cli/backend_options.h"
#ifdef PICTURA_HAS_BENCH
#include "pictura/bench/render.h"
#endif
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/evaluation/evaluate_scenes.h"

namespace pictura {

namespace {

struct ScenesArguments {
  SceneEvaluateOptions evaluate;
  std::string protocol = "womd";
  std::vector<std::string> rules;
  int copies = 1, repeats = 5;
  bool json = false;
  std::optional<EarlierReport> earlier;
};

SceneEvaluation measured(const SceneEvaluateOptions& options) {
  SceneEvaluation evaluation = evaluate_scenes(options);
  if (evaluation.interrupted) throw Interrupted("interrupted");
  PICTURA_CHECK(evaluation.results.scored() > 0, "bench scenes: expected a scene with a road user to drive, got none");
  return evaluation;
}

void run_scenes(const ScenesArguments& arguments) {
  SceneEvaluateOptions options = arguments.evaluate;
  const bool has_policy = options.controller.empty();
  if (options.checkpoint.empty() && has_policy) fail_usage("bench scenes: expected a CHECKPOINT or --policy");
  if (options.scenes.empty()) fail_usage("bench scenes: expected --scenes");
  options.protocol = scene_protocol(arguments.protocol);
  for (const std::string& rule : arguments.rules) set_scene_rule(rule, &options.protocol);
  ProgressLine progress;
  progress.update("warming up");
  measured(options);  // fills the cache of scenes and compiles kernels
  const std::vector<std::string> names = options.scenes;
  for (int copy = 1; copy < arguments.copies; ++copy) {
    options.scenes.insert(options.scenes.end(), names.begin(), names.end());
  }
  const std::string name =
      fmt::format("{}, {}", arguments.protocol, has_policy ? options.checkpoint : options.controller);
  BenchResult scenes{name, "scenes_per_min", {}}, steps{name + ", driven agents", "agent_steps_per_s", {}};
  SceneEvaluation last;
  for (int repeat = 0; repeat < arguments.repeats; ++repeat) {
    options.on_progress = [&](double done, double eta_s) {
      progress.update(fmt::format("repeat {} of {}: {:.0f} %  ETA {}", repeat + 1, arguments.repeats, 100 * done,
                                  format_duration(eta_s)));
    };
    last = measured(options);
    scenes.values.push_back(60 * last.results.scored() / last.seconds);
    steps.values.push_back(static_cast<double>(last.results.agent_steps()) / last.seconds);
  }
  progress.finish();
  const EvaluationSetting& setting = last.results.setting;
  const SceneProtocol& protocol = options.protocol;
  std::string images;
  if (!setting.image_sizes.empty()) {
    images = fmt::format(", images {} by {}, {} samples", fmt::join(setting.image_sizes, " "), setting.renderer,
                         setting.samples);
  }
  BenchContext context{
      .workload = fmt::format("scenes: {} copies of {}, {} scored; protocol {}, {} steps, {} densities, {} rollouts{}",
                              arguments.copies, fmt::join(names, " "), last.results.scored(), protocol.name,
                              protocol.steps, protocol.densities.size(), protocol.rollouts, images),
      .backend = setting.device};
#ifdef PICTURA_HAS_BENCH
  if (setting.device.starts_with("cuda")) context.add_gpu(cuda_device_name(), cuda_driver_name());
#endif
  report_benchmark(arguments.json, context, {scenes, steps}, arguments.earlier);
}

}  // namespace

void add_scenes_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<ScenesArguments>();
  SceneEvaluateOptions& options = arguments->evaluate;
  CLI::App* command = bench.add_subcommand("scenes", "Evaluations in recorded scenes, like evaluate --protocol");
  command->add_option("CHECKPOINT", options.checkpoint, "Checkpoint written by train, or safetensors");
  command->add_option("--policy", options.controller, "Controller that drives instead, such as idm or random");
  command->add_option("--protocol", arguments->protocol, "Protocol, as in evaluate")
      ->check(one_of(scene_protocol_names()))
      ->capture_default_str();
  command
      ->add_option("--scenes", options.scenes,
                   "Files, folders of files, FILE#K or FILE#SCENARIO_ID, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_number_option(command, "--copies", arguments->copies, "Evaluations of each scene per measurement", 1, 100'000);
  command
      ->add_option("--rule", arguments->rules,
                   "NAME=VALUE, which replaces a setting of the protocol; may be given several times")
      ->allow_extra_args(false);
  add_number_option(command, "--at-once", options.scenes_at_once,
                    "Scenes simulated together; default: 256 on a device, 16 on the host", 1, 100'000);
  add_sampled_option(command, &options.argmax);
  add_policy_backend_options(command, "auto (renderer: as in training)", &options);
  add_threads_option(command, &options.num_threads);
  add_number_option(command, "--repeats", arguments->repeats, "Measurements; the median is printed", 1, 1000);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  add_compare_option(command, &arguments->earlier);
  command->footer(
      "Examples:\n"
      "  pictura bench scenes run.ckpt --scenes validation/ --repeats 3\n"
      "  pictura bench scenes run.ckpt --scenes scene.tfrecord --copies 1000 --device cuda --json\n"
      "  pictura bench scenes --policy idm --protocol waymax --scenes scene.tfrecord --copies 20");
  command->callback([arguments] { run_scenes(*arguments); });
}

}  // namespace pictura
