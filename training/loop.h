// Training of a policy by self-play. Includes no torch headers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/portable/hd.h"
#include "pictura/training/event_file.h"
#include "pictura/training/phases.h"
#include "pictura/training/ranks/launch.h"

namespace pictura {

/// Work and time of one update.
struct UpdateCost {
  int64_t agent_steps = 0, slot_steps = 0;  // steps of active agents, and of all slots, in the rollout
  double kept_fraction = 0;                 // share of valid transitions that the filter keeps
  int64_t minibatches = 0;
  double first_kl = 0;                 // KL divergence due to rounding, in the first minibatch before parameters change
  double rollout_s = 0, update_s = 0;  // wall times of the rollout and of the update
  PhaseSeconds phases_s{};             // times of the phases of rollout and update
};

/// Progress of a run, given to on_progress after every update.
struct TrainProgress {
  int64_t update = 0, updates = 0;
  int64_t agent_steps = 0;
  double agent_steps_per_s = 0;         // since the run began or was resumed
  double recent_agent_steps_per_s = 0;  // over the last minute
  double episode_return = 0;            // mean over agent episodes that ended in the last updates; NaN before the first
  double eta_s = 0;              // time until train.updates, the schedule or `minutes` ends, whichever comes first
  bool ends_by_minutes = false;  // whether the end of `minutes` comes first; eta_s is then an upper bound
  Scalars scalars;               // values logged for this update, as in progress.csv
  UpdateCost cost;               // cost of this update
};

/// Treatment of an existing run in the folder.
enum class OldRun {
  refuse,
  resume,     // continue from its checkpoint
  overwrite,  // remove its files; other files stay
};

struct TrainOptions {
  std::string config_path;             // TOML, see docs/reference/configuration.md for every key
  std::vector<std::string> overrides;  // for instance "train.updates=2"
  std::string out_folder;
  OldRun old_run = OldRun::refuse;
  std::string init_from;  // checkpoint or safetensors of the same network, from which only weights are read
  double minutes = 0;     // wall-time limit, start-up included; the last update ends before it; 0: none
  std::string commit;     // commit of this program, for the metadata of policy.safetensors
  Launch launch;          // place of this process among the processes that train together
  std::function<void(const TrainProgress&)> on_progress;  // called by rank 0 only, as is on_notice
  std::function<void(const std::string&)> on_notice;      // receives messages that are not errors

  void notify(const std::string& notice) const {
    if (on_notice) on_notice(notice);
  }
};

struct TrainReport {
  // Members up to km_driven cover all ranks.
  int64_t agent_steps = 0, updates = 0;
  double agent_steps_per_s = 0, episode_return = 0, km_driven = 0;
  int ranks = 1;
  double evaluation_s = 0;  // time of this process in evaluations (train.evaluate_every); rates exclude it
  bool interrupted = false, out_of_time = false;
  std::string checkpoint, policy_hash;
  // Memory of a CUDA device, else 0. device_bytes: bytes that all processes use after the last update, including
  // torch's cache. peak_tensor_bytes: peak memory of tensors.
  int64_t device_bytes = 0, peak_tensor_bytes = 0;
  std::string device, simulator, renderer;  // names; `renderer` is empty without images
};

/// Error thrown if the tensors of a run do not fit into the device's memory; a smaller train.forward_chunk may fit.
class OutOfMemory : public Error {
 public:
  using Error::Error;
};

/// Trains with the given configuration. Writes the following files into out_folder:
/// - config.toml: the resolved configuration
/// - untrained.ckpt: the policy before its first update
/// - checkpoint.ckpt, older checkpoints (train.keep_checkpoints) and milestones (train.milestone_agent_steps)
/// - policy.safetensors, and policy_average.safetensors if train.weight_average is set
/// - progress.csv, evaluation.csv if train.evaluate_every is set, and TensorBoard events
///
/// After an interrupt (common/support/interrupt.h) the function saves and returns with `interrupted`. It returns with
/// `out_of_time` if another update would not end within `minutes`. The expected duration is 1.2 times that of the
/// longest update of this process. Before the first update, the longest update of an earlier process counts instead if
/// that process had equally many agents and a device of the same product. Throws Error naming file and key for bad
/// input. Throws Error naming the folder if another run is active in it, or if it holds a run and old_run is `refuse`.
/// Throws OutOfMemory if the device's memory is too small.
///
/// Several processes train one policy if each calls this function with its `launch` and equal settings. Rank 0 alone
/// reads and writes files. An interrupt of one process ends all processes after the same update. If a rank fails, ends
/// or hangs, all processes throw Error naming that rank.
TrainReport train(const TrainOptions& options);

}  // namespace pictura
