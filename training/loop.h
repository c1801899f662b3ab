// Training a policy by self-play, without torch headers.
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
  int64_t agent_steps = 0, slot_steps = 0;  // in its rollout
  double kept_fraction = 0;                 // of valid transitions, by the filter
  int64_t minibatches = 0;
  double first_kl = 0;                 // KL divergence of the first minibatch, before parameters change: rounding alone
  double rollout_s = 0, update_s = 0;  // wall time of collecting, and of improving
  PhaseSeconds phases_s{};             // in both
};

/// Progress of a run, given to on_progress after every update.
struct TrainProgress {
  int64_t update = 0, updates = 0;
  int64_t agent_steps = 0;
  double agent_steps_per_s = 0;         // since the run began or went on
  double recent_agent_steps_per_s = 0;  // of the last minute
  double episode_return = 0;            // mean over agent episodes that ended in the last updates; NaN before the first
  double eta_s = 0;              // to the last update, the end of the schedule or of `minutes`, whichever comes first
  bool ends_by_minutes = false;  // the end of `minutes` comes first: eta_s is a bound
  Scalars scalars;               // logged of this update, as in progress.csv
  UpdateCost cost;               // of this update
};

/// Treatment of a run that lies in the folder already.
enum class OldRun {
  refuse,
  resume,     // go on from its checkpoint
  overwrite,  // remove its files; others stay
};

struct TrainOptions {
  std::string config_path;             // TOML, see docs/reference/configuration.md for every key
  std::vector<std::string> overrides;  // "train.updates=2"
  std::string out_folder;
  OldRun old_run = OldRun::refuse;
  std::string
      init_from;  // begin with the weights of this checkpoint or safetensors, of the same network, and nothing else
  double minutes = 0;  // of wall time, start-up included, within which the last update ends; 0: no limit
  std::string commit;  // of this program, for the metadata of policy.safetensors
  Launch launch;       // which of the processes that train together this one is
  std::function<void(const TrainProgress&)> on_progress;  // called by rank 0 alone, as on_notice
  std::function<void(const std::string&)> on_notice;      // receives what a person should know and is no error

  void notify(const std::string& notice) const {
    if (on_notice) on_notice(notice);
  }
};

struct TrainReport {
  int64_t agent_steps = 0, updates = 0;  // of all ranks, as all below but the device's bytes
  double agent_steps_per_s = 0, episode_return = 0, km_driven = 0;
  int ranks = 1;
  double evaluation_s = 0;  // of this process, in train.evaluate_every's evaluations, which count in no rate
  bool interrupted = false, out_of_time = false;
  std::string checkpoint, policy_hash;
  // Memory of a CUDA device, else 0: in use by all processes after the last update, when torch still keeps what it has
  // ever taken; and the maximum that tensors took at once.
  int64_t device_bytes = 0, peak_tensor_bytes = 0;
  std::string device, simulator, renderer;  // what learnt, simulated and drew; no renderer where there are no images
};

/// The tensors of a run do not fit into the device's memory; a smaller train.forward_chunk may.
class OutOfMemory : public Error {
 public:
  using Error::Error;
};

/// Trains as the configuration says and writes into out_folder: config.toml (resolved), untrained.ckpt (the policy
/// before its first update), checkpoint.ckpt, older ones and milestones as train.keep_checkpoints and
/// milestone_agent_steps say, policy.safetensors, policy_average.safetensors where train.weight_average asks for it,
/// progress.csv, evaluation.csv where train.evaluate_every does, and TensorBoard events. After ^C or the like
/// (common/support/interrupt.h) it saves and returns with `interrupted`; where another update, as long as the longest
/// of this process (before its first one: of an earlier one on such a device), would not end within `minutes`, with
/// `out_of_time`. Throws Error naming file and key for bad input, and naming the folder where another run is at work,
/// and where one lies that old_run does not speak of; OutOfMemory where the device's memory is too small.
///
/// Several processes train one policy where each calls this with its `launch` and equal settings. Rank 0 alone reads
/// and writes files. A request to end one of them ends all after the same update. Throws Error in all naming the rank
/// where one fails, ends or hangs.
TrainReport train(const TrainOptions& options);

}  // namespace pictura
