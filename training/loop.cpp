// Training loop: collect a rollout, improve the policy, count, log and save.
#include "pictura/training/loop.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/configuration/config_keys.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/agent_groups.h"
#include "pictura/training/collector.h"
#include "pictura/training/host_memory.h"
#include "pictura/training/memory.h"
#include "pictura/training/ranks/agree.h"
#include "pictura/training/ranks/ranks.h"
#include "pictura/training/run.h"
#include "pictura/training/run_evaluation.h"
#include "pictura/training/run_folder.h"
#include "pictura/training/run_keeper.h"
#include "pictura/training/run_log.h"
#include "pictura/training/run_time.h"
#include "pictura/training/schedule.h"

namespace pictura {

namespace {

// Loop of updates until the run is complete, out of time, or interrupted.
class TrainingLoop {
 public:
  /// The arguments must outlive this object.
  TrainingLoop(const TrainOptions& options, Ranks* ranks, RunKeeper* keeper, RunTime* time, RunLog* log, Run* run)
      : options_(options),
        ranks_(*ranks),
        keeper_(*keeper),
        time_(*time),
        log_(*log),
        run_(*run),
        collector_(run),
        evaluation_(*run) {}

  void go() {
    evaluate_if_due();
    while (has_more_updates()) {
      UpdateRecord record;
      exchange_scenes();
      if (!collect(&record)) return;
      update_policy(&record);
      count(record);
      TrainProgress progress = log_.add(run_.update, run_.agent_steps, record);
      time_.limit_eta(&progress);
      update_image_size();
      evaluate_if_due();
      is_interrupted_ = any_rank_interrupted(run_.communicator);
      keep(record.totals.agent_steps);
      agent_steps_per_s_ = progress.agent_steps_per_s;
      if (options_.on_progress) options_.on_progress(progress);
    }
  }

  bool is_interrupted() const { return is_interrupted_; }
  bool is_out_of_time() const { return is_out_of_time_; }
  /// Returns the rate up to the last update.
  double agent_steps_per_s() const { return agent_steps_per_s_; }

 private:
  bool has_more_updates() {
    const TrainSection& train = run_.config.train;
    if (is_interrupted_ || is_out_of_time_) return false;
    if (run_.update >= train.updates || schedule_has_ended(train, run_.agent_steps)) return false;
    is_out_of_time_ = time_.would_exceed_limit(RunWork::update);
    return !is_out_of_time_;
  }

  void exchange_scenes() {
    if (run_.exchange_scenes()) collector_.forget_worlds();
    if (!run_.scenes) return;
    for (const std::string& notice : run_.scenes->take_notices()) options_.notify(notice);
  }

  // Collects a rollout. Returns false after an interrupt; the run's state is then that of the rollout's start, from
  // which resuming is exact.
  bool collect(UpdateRecord* record) {
    const std::unique_ptr<StateSnapshot> before = run_.simulator->snapshot();
    const SimulatorTotals totals_before = run_.simulator->totals();
    const Stopwatch watch;
    if (!collector_.collect()) {
      run_.simulator->restore(*before);
      is_interrupted_ = true;
      return false;
    }
    record->totals = run_.simulator->totals();
    record->totals.subtract(totals_before);
    record->totals = totals_of_all(record->totals, run_.communicator);
    record->image_size = run_.image_size();
    record->rollout_s = watch.seconds();
    return true;
  }

  // Improves the policy on the rollout. If the update fails because a number is not finite, saves its minibatch.
  void update_policy(UpdateRecord* record) {
    const Stopwatch watch;
    try {
      record->stats = run_.update_policy();
    } catch (const NotFinite& error) {
      run_.communicator->step();  // throws if a rank is lost; numbers are then meaningless
      if (!run_.communicator->is_first()) throw;
      const std::string path = keeper_.path("failed_minibatch.safetensors");
      write_safetensors(path, error.minibatch, to_toml(run_.config));
      fail("{}; see {}", error.what(), path);
    }
    run_.on_stream([&] {
      scale_logits(*run_.policy, logit_growth(run_.config.train, record->totals.agent_steps));
      if (run_.average) run_.average->update();
    });
    record->update_s = watch.seconds();
    record->phases_s = run_.timer.take();
    record->agents = group_agents(run_.rollout, record->stats.adv_threshold, run_.communicator);
  }

  void count(const UpdateRecord& record) {
    time_.add(RunWork::update, record.rollout_s + record.update_s);
    ++run_.update;
    run_.check_ranks_agree();
    run_.agent_steps += record.totals.agent_steps;
    run_.distance_m += record.totals.distance_m;
  }

  void update_image_size() {
    const auto pixels = static_cast<double>(run_.image_size().pixels());
    const std::string change = run_.update_image_size();
    if (change.empty()) return;
    options_.notify(change);
    time_.scale_expected_duration(std::max(1.0, static_cast<double>(run_.image_size().pixels()) / pixels));
  }

  // Evaluates if an evaluation is due. If an evaluation is interrupted, or there is no time for it, it takes place when
  // the run resumes. All ranks evaluate at the same update.
  void evaluate_if_due() {
    if (!any_rank(evaluation_.is_due() && log_.lacks_evaluation(run_.update), run_.communicator)) return;
    is_out_of_time_ = time_.would_exceed_limit(RunWork::evaluation);
    if (is_out_of_time_) return;
    const Ranks::LongWork evaluates(&ranks_);
    const std::optional<EvaluationRecord> record = evaluation_.evaluate();
    if (!record) return;
    log_.add_evaluation(run_.update, run_.agent_steps, *record);
    time_.add(RunWork::evaluation, record->seconds);
  }

  void keep(int64_t agent_steps_of_update) {
    // The milestone is saved first: a run that resumes from a later checkpoint would not save it.
    const std::string milestone = milestone_name(run_.agent_steps - agent_steps_of_update, run_.agent_steps,
                                                 run_.config.train.milestone_agent_steps);
    if (!milestone.empty()) keeper_.save_as(milestone, run_, log_.recent());
    if (keeper_.is_due(run_)) keeper_.save(run_, log_.recent());
  }

  const TrainOptions& options_;
  Ranks& ranks_;
  RunKeeper& keeper_;
  RunTime& time_;
  RunLog& log_;
  Run& run_;
  Collector collector_;
  RunEvaluation evaluation_;
  bool is_interrupted_ = false, is_out_of_time_ = false;
  double agent_steps_per_s_ = 0;
};

// Sets torch's process-wide settings.
void set_up_torch(const Config& config, Device device) {
  if (device.is_host()) retain_freed_memory();
  at::set_num_threads(resolve_num_threads(config.run.num_threads));
  set_float32_products(config.train.precision);
  set_reproducible(config.train.reproducible);
  release_unused_memory(device);  // memory of an earlier run
}

TrainReport train_on_its_device(const TrainOptions& options, Ranks* ranks) {
  const Stopwatch start;
  if (!(options.minutes >= 0 && std::isfinite(options.minutes))) {
    fail_usage("train: minutes: expected 0 (no limit) or more, got {}", options.minutes);
  }
  if (!options.init_trunk_from.empty() && options.old_run == OldRun::resume) {
    fail_usage("train: init_trunk_from '{}': expected a new run, got resume", options.init_trunk_from);
  }
  const Config config = load_config(options.config_path, options.overrides);
  check_equal_settings(config,
                       fmt::format("old_run {}, init_from '{}', init_trunk_from '{}'",
                                   static_cast<int>(options.old_run), options.init_from, options.init_trunk_from),
                       ranks);
  const Device device = open_learning_device(config, options.launch.local_rank);
  check_memory(config, device, available_bytes(device), ranks->size());
  check_map_memory(config, device, available_bytes(device), available_bytes(Device{}), ranks->size());
  // A rollout step or a minibatch of the paper's size takes minutes on a few cores.
  constexpr double kHostNoProgress_s = 900;
  if (device.is_host()) ranks->set_no_progress_s(kHostNoProgress_s);
  const std::unique_ptr<Communicator> communicator = make_communicator(ranks, device);
  RunKeeper keeper(options, ranks, communicator.get());
  set_up_torch(config, device);
  for (const std::string& notice : settings_without_effect(config)) options.notify(notice);

  Run run(config, device, communicator.get());
  const std::vector<RecentUpdate> recent = keeper.begin(&run);
  RunLog log(communicator->is_first() ? keeper.folder() : "", config, run.update, run.agent_steps, recent,
             options.on_notice);
  RunTime time(options.minutes, start, &run);
  TrainingLoop loop(options, ranks, &keeper, &time, &log, &run);
  loop.go();

  TrainReport report;
  const DeviceMemory memory = memory_of(device);
  report.device_bytes = memory.used_bytes;
  report.peak_tensor_bytes = memory.peak_tensor_bytes;
  keeper.save(run, log.recent());
  keeper.write_weights(run);
  report.checkpoint = keeper.checkpoint_path();
  report.ranks = communicator->size();
  report.device = name_of(device);
  report.simulator = run.simulator->name();
  if (run.renderer) report.renderer = run.renderer->name();
  report.interrupted = loop.is_interrupted();
  report.out_of_time = loop.is_out_of_time();
  report.agent_steps = run.agent_steps;
  report.updates = run.update;
  report.agent_steps_per_s = loop.agent_steps_per_s();
  report.episode_return = log.episode_return();
  report.km_driven = run.distance_m / 1000;
  report.evaluation_s = log.evaluation_s();
  report.policy_hash = run.policy->hash();
  return report;
}

}  // namespace

TrainReport train(const TrainOptions& options) {
  Ranks ranks(options.launch);
  TrainOptions of_rank = options;
  if (ranks.rank() > 0) of_rank.on_progress = {}, of_rank.on_notice = {};
  try {
    return train_on_its_device(of_rank, &ranks);
  } catch (const c10::OutOfMemoryError& error) {
    const std::string text = error.what_without_backtrace();
    const std::string why =
        "train: " + text.substr(0, text.find('\n')) +
        " A smaller train.forward_chunk or simulator.num_slots needs less memory, as does train.graphs = \"off\".";
    ranks.announce(why);
    throw OutOfMemory(why);
  } catch (const std::exception& error) {
    ranks.announce(error.what());
    throw;
  }
}

}  // namespace pictura
