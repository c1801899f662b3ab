// Training by self-play. Includes no torch headers.
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

/// Work and wall time of one update.
struct UpdateCost {
  int64_t agent_steps = 0, slot_steps = 0;  // steps of active agents, of all slots
  double kept_fraction = 0;                 // share of valid transitions with new decisions that the filter keeps
  int64_t minibatches = 0;
  double first_kl = 0;  // KL divergence due to rounding, before parameters change
  double rollout_s = 0, update_s = 0;
  PhaseSeconds phases_s{};
};

/// Progress of a run after an update.
struct TrainProgress {
  int64_t update = 0, updates = 0;
  int64_t agent_steps = 0;
  double agent_steps_per_s = 0;         // since start or resumption
  double recent_agent_steps_per_s = 0;  // over the last minute
  double episode_return = 0;            // mean over agent episodes of the last updates; NaN if none ended
  double eta_s = 0;                     // until train.updates are done, or the schedule or `minutes` ends
  bool ends_by_minutes = false;         // `minutes` ends first; eta_s is then an upper bound
  Scalars scalars;                      // logged values, as in progress.csv
  UpdateCost cost;
};

/// Treatment of a run that the folder already holds.
enum class OldRun {
  refuse,
  resume,     // continue from its checkpoint
  overwrite,  // remove its files; other files stay
};

struct TrainOptions {
  std::string config_path;             // TOML, see docs/reference/configuration.md
  std::vector<std::string> overrides;  // such as "train.updates=2"
  std::string out_folder;
  OldRun old_run = OldRun::refuse;
  std::string init_from;        // checkpoint or safetensors, from which only weights are read
  std::string init_trunk_from;  // file for Run::load_trunk(), after init_from; excludes OldRun::resume
  double minutes = 0;           // wall-time limit, start-up included; 0: none
  std::string commit;           // commit of this program, for metadata
  Launch launch;
  std::function<void(const TrainProgress&)> on_progress;  // called only by rank 0, like on_notice
  std::function<void(const std::string&)> on_notice;      // for messages that are not errors

  void notify(const std::string& notice) const {
    if (on_notice) on_notice(notice);
  }
};

struct TrainReport {
  // Members up to km_driven cover all ranks.
  int64_t agent_steps = 0, updates = 0;
  double agent_steps_per_s = 0, episode_return = 0, km_driven = 0;
  int ranks = 1;
  double evaluation_s = 0;  // time of this process in evaluations, which rates exclude
  bool interrupted = false, out_of_time = false;
  std::string checkpoint, policy_hash;
  // CUDA device memory of all processes after the last update, and peak memory of tensors; 0 on the host.
  int64_t device_bytes = 0, peak_tensor_bytes = 0;
  std::string device, simulator, renderer;  // `renderer` is empty without images
};

/// Error of tensors that do not fit into the device's memory; a smaller train.forward_chunk may fit.
class OutOfMemory : public Error {
 public:
  using Error::Error;
};

/// Trains a policy, and writes into out_folder:
/// - config.toml: the resolved configuration
/// - untrained.ckpt: the policy before its first update
/// - checkpoint.ckpt, older checkpoints (train.keep_checkpoints) and milestones (train.milestone_agent_steps)
/// - policy.safetensors, and policy_average.safetensors if train.weight_average is set
/// - progress.csv, evaluation.csv if train.evaluate_every is set, and TensorBoard events
///
/// After an interrupt (common/support/interrupt.h) it saves and returns with `interrupted`. It returns with
/// `out_of_time` if another update might not end within `minutes` (training/run_time.h). Throws Error naming file and
/// key for bad input. Throws Error naming the folder if another run is active in it, or if it holds a run and old_run
/// is `refuse`. Throws OutOfMemory if the device's memory is too small.
///
/// Several processes train one policy if each calls this function with its `launch` and equal settings. Only rank 0
/// reads and writes files. An interrupt ends all processes after the same update. If a rank fails, ends or hangs, all
/// processes throw Error naming it.
TrainReport train(const TrainOptions& options);

}  // namespace pictura
