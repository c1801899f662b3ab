// The training loop: collect a rollout, improve the policy on it, log and save.
#include "pictura/training/loop.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include <ATen/Parallel.h>
#include <fmt/ranges.h>

#include "pictura/backends/make_learner.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/folder_lock.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/training/algorithm.h"
#include "pictura/training/config_keys.h"
#include "pictura/training/diagnosis.h"
#include "pictura/training/host_memory.h"
#include "pictura/training/memory.h"
#include "pictura/training/precision.h"
#include "pictura/training/ranks/agree.h"
#include "pictura/training/ranks/ranks.h"
#include "pictura/training/run.h"
#include "pictura/training/run_evaluation.h"
#include "pictura/training/run_folder.h"
#include "pictura/training/run_log.h"
#include "pictura/training/schedule.h"
#include "pictura/training/torch_device.h"

namespace pictura {

namespace {

// Improves the policy on the rollout. What stops it for a number that is not finite is kept in the folder for study.
UpdateStats improve(const std::string& folder, Run* run) {
  try {
    return improve(run);
  } catch (const NotFinite& error) {
    run->communicator->step();  // throws where a rank is lost, which leaves numbers that mean nothing
    if (!run->communicator->is_first()) throw;
    const std::string path = folder + "/failed_minibatch.safetensors";
    write_safetensors(path, error.minibatch, to_toml(run->config));
    fail("{}; see {}", error.what(), path);
  }
}

TrainReport train_on_its_device(const TrainOptions& options, Ranks* ranks) {
  const Stopwatch since_start;
  const Config config = load_config(options.config_path, options.overrides);
  check_equal_settings(
      config, fmt::format("old_run {}, init_from '{}'", static_cast<int>(options.old_run), options.init_from), ranks);
  const Device device = open_learning_device(config, options.launch.local_rank);
  check_memory(config, device, available_bytes(device), ranks->size());
  const std::unique_ptr<Communicator> communicator = make_communicator(ranks, device);
  const bool is_first = communicator->is_first();
  std::optional<FolderLock> lock;
  std::vector<std::string> old_files;
  if (is_first) {
    make_output_folder(options.out_folder);
    lock.emplace(options.out_folder);
    old_files = run_files(options.out_folder);
    PICTURA_CHECK(old_files.empty() || options.old_run != OldRun::refuse,
                  "{}: holds a run already ({}): resume it, overwrite it, or name another folder", options.out_folder,
                  fmt::join(old_files, ", "));
  }
  if (device.is_host()) keep_freed_memory();
  at::set_num_threads(resolve_num_threads(config.run.num_threads));
  set_float32_products(config.train.precision);
  set_reproducible(config.train.reproducible);
  release_unused_memory(device);  // of an earlier run

  const auto notify = [&options](const std::string& notice) {
    if (options.on_notice) options.on_notice(notice);
  };
  for (const std::string& notice : idle_settings(config)) notify(notice);
  TrainReport report;
  report.checkpoint = options.out_folder + "/checkpoint.ckpt";
  report.ranks = communicator->size();
  Run run(config, device, communicator.get());
  report.device = name_of(device);
  report.simulator = run.simulator->name();
  if (run.renderer) report.renderer = run.renderer->name();
  Collector collector(&run);
  std::vector<RecentUpdate> recent;
  const auto bytes_everywhere = [&](const std::string& path) {
    return communicator->from_first(is_first ? read_checkpoint_file(path) : "");
  };
  // All ranks take part in a checkpoint; the first one writes it.
  const auto write_with = [&](const auto& write, const std::vector<RecentUpdate>& its_recent) {
    const Checkpoint checkpoint = run.checkpoint(its_recent);
    const Ranks::LongWork writes(ranks);  // disks may be slow
    if (is_first) write(checkpoint);
  };
  const auto save_as = [&](const std::string& name, const std::vector<RecentUpdate>& its_recent) {
    write_with([&](const Checkpoint& checkpoint) { write_checkpoint(options.out_folder + "/" + name, checkpoint); },
               its_recent);
  };
  if (options.old_run == OldRun::resume) {
    const Checkpoint saved = parse_checkpoint(bytes_everywhere(report.checkpoint), report.checkpoint);
    const std::string why_new_episodes = run.restore(saved);
    if (!why_new_episodes.empty()) notify("the saved episodes cannot go on, new ones begin: " + why_new_episodes);
    for (const std::string& change : differences_to_report(saved.config, config)) notify(change);
    recent = saved.recent;
  } else {
    if (!options.init_from.empty()) {
      run.begin_with(parse_policy(bytes_everywhere(options.init_from), options.init_from));
    }
    for (const std::string& name : old_files) std::filesystem::remove(options.out_folder + "/" + name);
    run.simulator->reset();
    save_as("untrained.ckpt", recent);
  }
  if (is_first) write_file(options.out_folder + "/config.toml", to_toml(with_absolute_paths(config)));
  RunLog log(is_first ? options.out_folder : "", config, run.update, run.agent_steps, recent, options.on_notice);

  Stopwatch since_saved;
  int64_t saved_update = options.old_run == OldRun::resume ? run.update : -1;
  const auto save = [&] {
    // A second time it would be the same, in the place of an older one.
    if (run.update == saved_update) return;
    write_with(
        [&](const Checkpoint& checkpoint) {
          save_checkpoint(options.out_folder, config.train.keep_checkpoints,
                          [&](const std::string& path) { write_checkpoint(path, checkpoint); });
        },
        log.recent());
    saved_update = run.update;
    since_saved.restart();
  };
  // Before the first update of this process it is that of an earlier one, where the run was on such a device before.
  const std::string machine = fmt::format("{}, {} agents", product_name(device), run.simulator->num_slots());
  double own_longest_s = 0;
  const auto ends_too_late = [&](const std::string& work) {
    // A fifth more, for what takes longer than the longest before, and for saving.
    const auto longest = run.longest_update_s.find(work);
    const double expected_s = longest == run.longest_update_s.end() ? 0 : 1.2 * longest->second;
    return any_rank(options.minutes > 0 && since_start.seconds() + expected_s > 60 * options.minutes,
                    communicator.get());
  };
  // One that there is no time for, or that was interrupted, is made when the run goes on. All ranks make the same one.
  RunEvaluation evaluation(run);
  const std::string evaluation_on_machine = machine + ", evaluation";
  const auto evaluate_if_due = [&] {
    if (!any_rank(evaluation.is_due() && log.lacks_evaluation(run.update), communicator.get())) return;
    report.out_of_time = ends_too_late(evaluation_on_machine);
    if (report.out_of_time) return;
    const Ranks::LongWork evaluates(ranks);
    const std::optional<EvaluationRecord> record = evaluation.evaluate();
    if (!record) return;
    log.add_evaluation(run.update, run.agent_steps, *record);
    double& longest_s = run.longest_update_s[evaluation_on_machine];
    longest_s = std::max(longest_s, record->seconds);
  };
  evaluate_if_due();
  while (run.update < config.train.updates && !schedule_has_ended(config.train, run.agent_steps) &&
         !report.interrupted && !report.out_of_time) {
    report.out_of_time = ends_too_late(machine);
    if (report.out_of_time) break;
    const std::unique_ptr<StateSnapshot> before = run.simulator->snapshot();
    const SimulatorTotals totals_before = run.simulator->totals();
    UpdateRecord record;
    Stopwatch watch;
    if (!collector.collect()) {
      // ^C within a rollout: what is saved is the state at its start, from which resuming is exact.
      run.simulator->restore(*before);
      report.interrupted = true;
      break;
    }
    record.totals = run.simulator->totals();
    record.totals.subtract(totals_before);
    record.totals = totals_of_all(record.totals, communicator.get());
    record.rollout_s = watch.restart();
    record.image_size = run.image_size();

    record.stats = improve(options.out_folder, &run);
    run.on_stream([&] { scale_logits(*run.policy, logit_growth(config.train, record.totals.agent_steps)); });
    record.update_s = watch.restart();
    record.phases_s = run.timer.take();
    record.diagnosis = diagnose(run.rollout, record.stats.adv_threshold, communicator.get());
    own_longest_s = std::max(own_longest_s, record.rollout_s + record.update_s);
    run.longest_update_s[machine] = own_longest_s;

    ++run.update;
    run.check_ranks_agree();
    const std::string milestone = milestone_name(run.agent_steps, run.agent_steps + record.totals.agent_steps,
                                                 config.train.milestone_agent_steps);
    run.agent_steps += record.totals.agent_steps;
    run.distance_m += record.totals.distance_m;
    TrainProgress progress = log.add(run.update, run.agent_steps, record);
    const double left_s = 60 * options.minutes - since_start.seconds();
    if (options.minutes > 0 && left_s < progress.eta_s) {
      progress.eta_s = std::max(0.0, left_s);
      progress.ends_by_minutes = true;
    }
    report.agent_steps_per_s = progress.agent_steps_per_s;
    const auto pixels = static_cast<double>(run.image_size().pixels());
    if (const std::string change = run.update_image_size(); !change.empty()) {
      notify(change);
      // Until an update of that size is measured: as much longer as there are more pixels.
      own_longest_s = 0;
      const double growth = std::max(1.0, static_cast<double>(run.image_size().pixels()) / pixels);
      for (const std::string& work : {machine, evaluation_on_machine}) {
        if (run.longest_update_s.contains(work)) run.longest_update_s[work] *= growth;
      }
    }
    evaluate_if_due();
    report.interrupted = any_rank_interrupted(communicator.get());
    if (run.update % config.train.checkpoint_every == 0 ||
        any_rank(since_saved.seconds() > 60 * config.train.checkpoint_minutes, communicator.get())) {
      save();
    }
    if (!milestone.empty()) save_as(milestone, log.recent());
    if (options.on_progress) options.on_progress(progress);
  }

  const DeviceMemory memory = memory_of(device);
  report.device_bytes = memory.used_bytes;
  report.peak_tensor_bytes = memory.peak_tensor_bytes;
  save();
  if (is_first) {
    write_policy(options.out_folder + "/policy.safetensors", run.saved_policy(), WeightType::f32, options.commit);
  }
  report.agent_steps = run.agent_steps;
  report.updates = run.update;
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
        " A smaller train.forward_chunk or simulator.num_slots takes less, and so does train.graphs = "
        "\"off\".";
    ranks.announce(why);
    throw OutOfMemory(why);
  } catch (const std::exception& error) {
    ranks.announce(error.what());
    throw;
  }
}

}  // namespace pictura
