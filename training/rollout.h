// What all slots of a simulator saw, did and got in one rollout, as tensors; time first.
#pragma once

#include "pictura/training/observation.h"

namespace pictura {

struct Rollout {
  Observation observation;                  // [num_steps + 1, num_slots, ...]; the last row is seen after the last step
  at::Tensor values;                        // f32 [num_steps + 1, num_slots]
  at::Tensor actions;                       // i32 [num_steps, num_slots], as all below
  at::Tensor log_probs;                     // f32, of the chosen actions
  at::Tensor rewards;                       // f32
  at::Tensor terminated, truncated, valid;  // u8, as StepResult defines them
  at::Tensor advantages;                    // f32, see rules/gae.h

  Rollout(Observation storage, int64_t num_steps, int64_t num_slots);
  int64_t num_steps() const { return actions.size(0); }
  int64_t num_slots() const { return actions.size(1); }

  /// Begins the next rollout: what was seen after the last step becomes the first row.
  void begin();
  /// The actions of one step, to be filled. [num_slots]
  Span<int32_t> actions_at(int64_t step);
  /// Keeps what the step with these actions returned.
  void set_result(int64_t step, const StepResult& result);
  /// Fills `advantages` from rewards, values and flags.
  void compute_advantages(double gamma, double gae_lambda);
};

/// Storage for the observations of a rollout of `num_steps` steps. Memory is handed out before it is there, so one that
/// can never fit this machine is refused: throws Error naming the settings that decide its size.
Observation allocate_rollout(const Observer& observer, int num_slots, int num_steps);

}  // namespace pictura
