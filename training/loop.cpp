// The training loop: collect a rollout, improve the policy on it, log and save.
#include "pictura/training/loop.h"

#include <ATen/Parallel.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/training/run.h"
#include "pictura/training/run_log.h"

namespace pictura {

namespace {

// Fills the rollout from the policy's own driving; false when ^C came.
bool collect(Run* run, PhaseTimes* times_out) {
  const Config& config = run->config;
  Rollout& rollout = run->rollout;
  const int64_t num_steps = rollout.num_steps();
  Stopwatch watch;
  rollout.begin();
  for (int64_t step = 0; step < num_steps; ++step) {
    if (interrupted()) return false;

    // Act.
    watch.restart();
    const Decision decision = decide(run->policy, row_of(rollout.observation, step), config.train.forward_chunk);
    const Span<int32_t> actions = rollout.actions_at(step);
    choose_actions(decision.log_probs, run->simulator->controller_input(), config.run.seed, /*argmax=*/false, actions);
    const at::Tensor chosen = rollout.actions.select(0, step).to(at::kLong).unsqueeze(1);
    rollout.values.select(0, step).copy_(decision.value);
    rollout.log_probs.select(0, step).copy_(decision.log_probs.gather(1, chosen).squeeze(1));
    times_out->forward_s += watch.restart();

    // Step, and observe.
    const StepResult result = run->simulator->step(Span<const int32_t>(actions));
    times_out->simulate_s += watch.restart();
    rollout.set_result(step, result);
    run->observer.observe(row_of(rollout.observation, step + 1));
  }
  // The value of what is seen last, from which the last transitions bootstrap.
  const Decision last = decide(run->policy, row_of(rollout.observation, num_steps), config.train.forward_chunk);
  rollout.values.select(0, num_steps).copy_(last.value);
  return true;
}

// Improves the policy on the rollout.
UpdateStats improve(Run* run) {
  const Config& config = run->config;
  run->rollout.compute_advantages(config.train.gamma, config.train.gae_lambda);
  return ppo_update(run->policy, run->rollout, config.train, config.run.seed, run->update, &run->optimizer,
                    &run->filter);
}

}  // namespace

TrainReport train(const TrainOptions& options) {
  const Config config = load_config(options.config_path, options.overrides);
  check_devices(config);
  make_output_folder(options.out_folder);
  at::set_num_threads(resolve_num_threads(config.run.num_threads));

  TrainReport report;
  report.checkpoint = options.out_folder + "/checkpoint.ckpt";
  Run run(config);
  report.device = "cpu";
  report.simulator = run.simulator->name();
  if (run.renderer) report.renderer = run.renderer->name();
  std::vector<RecentUpdate> recent;
  if (options.resume) {
    const Checkpoint saved = read_checkpoint(report.checkpoint);
    run.restore(saved);
    recent = saved.recent;
  } else {
    run.simulator->reset();
    run.save(options.out_folder + "/untrained.ckpt", recent, run.simulator->save());
  }
  write_file(options.out_folder + "/config.toml", to_toml(config));
  RunLog log(options.out_folder, config, run.update, run.agent_steps, recent);

  run.observer.observe(row_of(run.rollout.observation, config.train.num_steps));
  while (run.update < config.train.updates && !report.interrupted) {
    const std::vector<uint8_t> simulator_before = run.simulator->save();
    const SimulatorTotals totals_before = run.simulator->totals();
    const double render_before_s = run.observer.render_s();
    UpdateRecord record;
    Stopwatch watch;
    if (!collect(&run, &record.times)) {
      // ^C within a rollout: what is saved is the state at its start, from which resuming is exact.
      run.save(report.checkpoint, log.recent(), simulator_before);
      report.interrupted = true;
      break;
    }
    record.times.rollout_s = watch.restart();
    record.times.render_s = run.observer.render_s() - render_before_s;
    record.totals = run.simulator->totals();
    record.totals.subtract(totals_before);

    record.stats = improve(&run);
    record.times.optimize_s = watch.restart();

    ++run.update;
    run.agent_steps += record.totals.agent_steps;
    run.distance_m += record.totals.distance_m;
    const TrainProgress progress = log.add(run.update, run.agent_steps, record);
    report.agent_steps_per_s = progress.agent_steps_per_s;
    report.interrupted = interrupted();
    if (report.interrupted || run.update == config.train.updates || run.update % config.train.checkpoint_every == 0) {
      run.save(report.checkpoint, log.recent(), run.simulator->save());
    }
    if (options.on_progress) options.on_progress(progress);
  }

  write_safetensors(options.out_folder + "/policy.safetensors", run.policy.parameters(), to_toml(config));
  report.agent_steps = run.agent_steps;
  report.updates = run.update;
  report.episode_return = log.episode_return();
  report.km_driven = run.distance_m / 1000;
  report.policy_hash = run.policy.hash();
  return report;
}

}  // namespace pictura
