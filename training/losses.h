// PPO's losses of some transitions.
#pragma once

#include "pictura/policy/policy.h"

namespace pictura {

/// What is learnt from transitions, of all of a rollout: [steps * slots].
struct Targets {
  at::Tensor actions;        // i64
  at::Tensor old_log_probs;  // of these actions
  at::Tensor returns;        // in units of rewards
  // Of all actions by the teacher, [steps * slots, kNumActions], and what the KL divergence from it weighs, []:
  // undefined where nobody is imitated.
  at::Tensor teacher_log_probs, teacher_weight;
};

struct Losses {
  at::Tensor policy, value, entropy;  // with gradients, as the next
  at::Tensor imitation;               // weighted; undefined where nobody is imitated
  at::Tensor stats;                   // f64 [7]: LossStats without the norm
};

/// Of the chosen actions of some rows; all_log_probs: [rows, kNumActions].
at::Tensor log_probs_of(const at::Tensor& all_log_probs, const Targets& targets, const at::Tensor& rows);

/// rows: i64 [n]; advantages: [n], as the losses take them; shares: [n], what each row counts in the means, or
/// undefined where each counts as one.
Losses losses_of(const Policy::Output& output, const Targets& targets, const at::Tensor& rows,
                 const at::Tensor& advantages, const at::Tensor& shares, double clip_coef);

}  // namespace pictura
