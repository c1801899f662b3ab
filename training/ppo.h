// Proximal policy optimization (Schulman et al., 2017) with the paper's settings: clipped surrogate, plain value loss,
// entropy bonus, advantages filtered per rollout and normalised per minibatch, AdamW under a cosine schedule.
#pragma once

#include "pictura/training/policy.h"

namespace pictura {

/// What all slots saw, did and got in num_steps steps; time first.
struct Rollout {
  Observation observation;                  // [num_steps + 1, num_slots, ...]; the last row is seen after the last step
  at::Tensor values;                        // f32 [num_steps + 1, num_slots]
  at::Tensor actions;                       // i32 [num_steps, num_slots], as all below
  at::Tensor log_probs;                     // f32, of the chosen actions
  at::Tensor rewards;                       // f32
  at::Tensor terminated, truncated, valid;  // u8, as StepResult defines them
  at::Tensor advantages;                    // f32, see gae.h

  Rollout(Observation storage, int64_t num_steps, int64_t num_slots);
  int64_t num_steps() const { return actions.size(0); }
  int64_t num_slots() const { return actions.size(1); }
  void compute_advantages(double gamma, double gae_lambda);
};

/// Drops transitions whose advantages are too small to teach anything (paper, appendix, optimization; after Gigaflow).
class AdvantageFilter {
 public:
  /// Takes in the newest rollout's max |advantage|: average = ema * newest + (1 - ema) * average, the first one as it
  /// is. Returns the least |advantage| that is kept.
  float threshold(float max_advantage, double ema, double fraction);
  double average = -1;  // of the rollouts' maxima; negative before the first
};

class AdamW {
 public:
  AdamW(const Policy& policy, const Config::Train& config);
  /// One step along the parameters' gradients, scaled down to max_grad_norm; clears them. Returns their norm before.
  double step(double learning_rate);

  std::vector<NamedTensor> first_moments, second_moments;  // in the order of the policy's parameters
  int64_t steps = 0;

 private:
  const std::vector<NamedTensor>& parameters_;
  Config::Train config_;
};

/// Cosine from learning_rate at update 0 to 0 at schedule_updates and beyond.
double cosine_rate(double learning_rate, int64_t update, int64_t schedule_updates);

/// A permutation of [0, n), a function of its arguments alone.
std::vector<int64_t> shuffled(int64_t n, uint64_t seed, int64_t update, int64_t epoch);

/// Means over the update's minibatches; docs/training.md defines them.
struct UpdateStats {
  double policy_loss = 0, value_loss = 0, entropy = 0, approx_kl = 0, clip_fraction = 0, grad_norm = 0;
  double explained_variance = 0, kept_fraction = 0, adv_threshold = 0;
  int64_t minibatches = 0;
};

/// Improves the policy on a rollout with advantages. Throws Error when a loss is not finite.
UpdateStats ppo_update(const Policy& policy, const Rollout& rollout, const Config::Train& config, uint64_t seed,
                       int64_t update, AdamW* optimizer_inout, AdvantageFilter* filter_inout);

}  // namespace pictura
