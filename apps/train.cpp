// `pictura train`: trains a policy by self-play PPO from a configuration file, with a progress line.
#include "pictura/apps/commands.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/train_progress.h"
#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/training/loop.h"

namespace pictura {

void add_train_command(CLI::App& app) {
  struct Arguments {
    TrainOptions train;
    SessionOptions backends{.device = "", .simulator = ""};
    bool resume = false, overwrite = false, json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("train", "Train a policy by self-play (PPO)");
  command
      ->add_option(
          "--config", arguments->train.config_path,
          "TOML file; configs/ contains smoke.toml, demo.toml, town01.toml, scenes.toml, agent.toml and paper.toml")
      ->required();
  command
      ->add_option("--set", arguments->train.overrides,
                   "Override a key, for instance train.updates=2; may be given several times")
      ->allow_extra_args(false);
  add_policy_backend_options(command, "as in the configuration", &arguments->backends);
  command->add_option("--out", arguments->train.out_folder, "Folder for checkpoints, curves and logs")->required();
  CLI::Option* const resume = command->add_flag("--resume", arguments->resume, "Resume from the checkpoint in --out");
  command
      ->add_flag("--overwrite", arguments->overwrite,
                 "Start a new run; the existing run in --out is removed once the new run has a checkpoint")
      ->excludes(resume);
  command
      ->add_option("--init-from", arguments->train.init_from,
                   "Checkpoint or safetensors file with the initial weights; it must have the same network, at any "
                   "image size")
      ->excludes(resume);
  command
      ->add_option(
          "--init-trunk-from", arguments->train.init_trunk_from,
          "Checkpoint or safetensors file with the initial weights of all layers behind the encoder of images "
          "or lists; it may have the other modality. With --init-from, only the encoder's weights are those of "
          "--init-from")
      ->excludes(resume);
  add_number_option(command, "--minutes", arguments->train.minutes,
                    "Limit of the wall time: saves and ends before an update that may exceed it, as estimated from the "
                    "longest update so far; continue with --resume",
                    1e-9, 1e9);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Several processes can train one policy, each on its own GPU: torchrun, srun or the variables RANK, WORLD_SIZE,\n"
      "LOCAL_RANK, MASTER_ADDR and MASTER_PORT define them. Sizes are totals of all processes. Rank 0 reports and "
      "writes.\n"
      "Examples:\n"
      "  pictura train --config configs/demo.toml --out runs/demo\n"
      "  pictura train --config configs/town01.toml --set run.seed=3 --set train.updates=50 --out runs/seed3\n"
      "  pictura train --config configs/town01.toml --out runs/town01 --resume --minutes 25\n"
      "  torchrun --nproc-per-node 2 --no-python pictura train --config configs/paper.toml --out runs/paper");
  command->callback([arguments] {
    ProgressLine line;
    std::string phases;
    arguments->train.on_progress = [&line, &phases](const TrainProgress& progress) {
      line.update(progress_text(progress));
      phases = phase_shares(progress);
    };
    arguments->train.on_notice = [](const std::string& notice) { print_message("notice: {}\n", notice); };
    if (arguments->resume) arguments->train.old_run = OldRun::resume;
    if (arguments->overwrite) arguments->train.old_run = OldRun::overwrite;
    for (const std::string& text : overrides_of(arguments->backends)) arguments->train.overrides.push_back(text);
    arguments->train.launch = launch_from_environment();
    arguments->train.commit = PICTURA_COMMIT;
    const TrainReport report = train(arguments->train);
    line.finish();
    const auto end_as_asked = [&] {
      if (report.interrupted) {
        throw Interrupted(fmt::format("interrupted; continue with --resume --out {}", arguments->train.out_folder));
      }
    };
    if (arguments->train.launch.rank > 0) return end_as_asked();
    if (arguments->json) {
      print_json({{"agent_steps", report.agent_steps},
                  {"agent_steps_per_s", report.agent_steps_per_s},
                  {"updates", report.updates},
                  {"episode_return", finite_or_null(report.episode_return)},
                  {"km_driven", report.km_driven},
                  {"evaluation_s", report.evaluation_s},
                  {"checkpoint", report.checkpoint},
                  {"policy_hash", report.policy_hash},
                  {"ranks", report.ranks},
                  {"device", report.device},
                  {"simulator", report.simulator},
                  {"renderer", report.renderer.empty() ? Json(nullptr) : Json(report.renderer)},
                  {"out_of_time", report.out_of_time}});
    } else {
      print_result("{} agent-steps in {} updates, {:.1f} km driven; checkpoint {}, policy hash {}\n",
                   format_count(static_cast<double>(report.agent_steps)), report.updates, report.km_driven,
                   report.checkpoint, report.policy_hash);
      if (!phases.empty()) print_result("time of the last update: {}\n", phases);
      if (report.out_of_time)
        print_result("out of time: continue with --resume --out {}\n", arguments->train.out_folder);
    }
    end_as_asked();
  });
}

}  // namespace pictura
