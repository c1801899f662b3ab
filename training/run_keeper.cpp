#include "pictura/training/run_keeper.h"

#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/configuration/config_keys.h"
#include "pictura/training/ranks/agree.h"
#include "pictura/training/run_folder.h"

namespace pictura {

namespace fs = std::filesystem;

RunKeeper::RunKeeper(const TrainOptions& options, Ranks* ranks, Communicator* communicator)
    : options_(options), ranks_(ranks), communicator_(communicator), folder_(options.out_folder) {
  if (!communicator->is_first()) return;
  // A run that uses the folder is reported first, and missing inputs before a folder is created.
  if (fs::is_directory(options.out_folder)) lock_.emplace(options.out_folder);
  for (const std::string& input :
       {options.old_run == OldRun::resume ? checkpoint_path() : "", options.init_from, options.init_trunk_from}) {
    PICTURA_CHECK(input.empty() || fs::exists(input), "{}: no such file", input);
  }
  make_output_folder(options.out_folder);
  if (!lock_) lock_.emplace(options.out_folder);
  old_files_ = run_files(options.out_folder);
  PICTURA_CHECK(
      old_files_.empty() || options.old_run != OldRun::refuse,
      "{}: already holds a run ({}): expected to resume or overwrite it (--resume, --overwrite), or another folder",
      options.out_folder, fmt::join(old_files_, ", "));
}

std::vector<RecentUpdate> RunKeeper::begin(Run* run) {
  std::vector<RecentUpdate> recent;
  if (options_.old_run == OldRun::resume) {
    const Checkpoint saved = parse_checkpoint(file_of_first(checkpoint_path(), communicator_), checkpoint_path());
    const std::string why_new_episodes = run->restore(saved);
    if (!why_new_episodes.empty()) {
      options_.notify("the saved episodes cannot continue, new episodes begin: " + why_new_episodes);
    }
    for (const std::string& change : differences_to_report(saved.config, run->config)) options_.notify(change);
    const OptimizerKind before = saved.config.train.optimizer, now = run->config.train.optimizer;
    if (before != now) {
      options_.notify(fmt::format("train.optimizer: {} holds moments of {}: new moments of {} start", checkpoint_path(),
                                  name_of(before), name_of(now)));
    }
    recent = saved.recent;
    saved_update_ = run->update;
  } else {
    const auto saved = [&](const std::string& file) { return parse_policy(file_of_first(file, communicator_), file); };
    if (!options_.init_from.empty()) run->load_policy(saved(options_.init_from));
    if (!options_.init_trunk_from.empty()) run->load_trunk(saved(options_.init_trunk_from));
    if (!old_files_.empty()) {
      folder_ = path(".pictura-new-run");
      fs::remove_all(folder_);  // left by a run that ended before its first checkpoint
      make_output_folder(folder_);
    }
    run->simulator->reset();
    save_as("untrained.ckpt", *run, recent);
  }
  if (communicator_->is_first()) write_file(path("config.toml"), to_toml(with_absolute_paths(run->config)));
  since_saved_.restart();
  return recent;
}

bool RunKeeper::is_due(const Run& run) const {
  const TrainSection& train = run.config.train;
  return run.update % train.checkpoint_every == 0 ||
         any_rank(since_saved_.seconds() > 60 * train.checkpoint_minutes, communicator_);
}

void RunKeeper::save(const Run& run, const std::vector<RecentUpdate>& recent) {
  // A second save of the same update would replace an older checkpoint.
  if (run.update == saved_update_) return;
  const auto write = [&](const Checkpoint& checkpoint) {
    save_checkpoint(folder_, run.config.train.keep_checkpoints,
                    [&](const std::string& path) { write_checkpoint(path, checkpoint); });
    if (folder_ != options_.out_folder) overwrite_old_run();
  };
  write_with(write, run, recent);
  saved_update_ = run.update;
  since_saved_.restart();
}

// Replaces the files of the old run. Files that are open for writing stay open.
void RunKeeper::overwrite_old_run() {
  for (const std::string& name : old_files_) fs::remove(fs::path(options_.out_folder) / name);
  for (const std::string& name : run_files(folder_)) fs::rename(path(name), fs::path(options_.out_folder) / name);
  fs::remove_all(folder_);
  folder_ = options_.out_folder;
}

void RunKeeper::save_as(const std::string& name, const Run& run, const std::vector<RecentUpdate>& recent) const {
  write_with([&](const Checkpoint& checkpoint) { write_checkpoint(path(name), checkpoint); }, run, recent);
}

void RunKeeper::write_with(const std::function<void(const Checkpoint&)>& write, const Run& run,
                           const std::vector<RecentUpdate>& recent) const {
  const Checkpoint checkpoint = run.checkpoint(recent);
  const Ranks::LongWork writes(ranks_);  // disks may be slow
  if (communicator_->is_first()) write(checkpoint);
}

void RunKeeper::write_weights(const Run& run) const {
  if (!communicator_->is_first()) return;
  write_policy(path("policy.safetensors"), run.saved_policy(), WeightType::f32, options_.commit);
  if (run.average) {
    write_policy(path("policy_average.safetensors"), run.averaged_policy(), WeightType::f32, options_.commit);
  }
}

}  // namespace pictura
