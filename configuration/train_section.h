// Section [train] of a configuration: settings of learning, and the length of a run.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

/// Arithmetic of the network on a CUDA device: IEEE fp32, fp32 with matrix products in TF32, or layers in bf16. See
/// policy/precision.h.
enum class Precision { fp32, tf32, bf16 };

/// Treatment of halted and absent agents. skip: they are neither drawn nor encoded. draw: they are drawn and encoded in
/// rollouts and updates, but the policy does not learn from them.
enum class HaltedSlots { skip, draw };

/// Decay of the learning rate to 0. With `constant` there is no decay.
enum class Schedule { constant, linear, cosine };

/// Optimizer of the parameters, see training/optimizer.h.
enum class OptimizerKind { adamw, muon };

/// Definition of the advantage filter's threshold (training/rules/advantage_filter.h): a fraction of the largest
/// |advantage|, or a quantile of the |advantages|.
enum class FilterThreshold { maximum, quantile };

struct TrainSection {
  int64_t updates = 19074;  // updates after which the run ends
  // Learning rate, see training/schedule.h.
  Schedule schedule = Schedule::cosine;
  int64_t schedule_agent_steps = 50'000'000'000;
  int64_t decay_agent_steps = 0;  // the rate falls in the last decay_agent_steps of the schedule; 0: throughout
  int64_t warm_up_agent_steps = 0;
  int num_steps = 128;            // steps per rollout
  bool stagger_episodes = false;  // ends the first episodes of worlds at different times, see max_steps_of()
  int64_t minibatch_size = 65536;
  int update_epochs = 2;
  int64_t forward_chunk = 2048;  // transitions in one pass through the network; gradients are accumulated
  double gamma = 0.999, gae_lambda = 0.95;
  double clip_coef = 0.2;
  double vf_coef = 0.5, ent_coef = 0.01;
  OptimizerKind optimizer = OptimizerKind::adamw;
  double learning_rate = 5e-4;
  double adam_beta1 = 0.9, adam_beta2 = 0.999, adam_eps = 1e-8, weight_decay = 0.01;
  double max_grad_norm = 0.5;
  // Half-life, in updates, of the average of weights (training/weight_average.h); 0: no average.
  double weight_average = 0;
  // Agent-steps in which the policy's logits double (training/schedule.h); 0: never.
  int64_t sharpen_agent_steps = 0;
  /// Path of a saved vector policy that the learner imitates (training/teacher.h), relative to the configuration's
  /// folder. The loss includes the KL divergence from the teacher's actions, multiplied by a weight. The weight falls
  /// linearly from teacher_coef to 0 over teacher_agent_steps.
  std::string teacher;
  double teacher_coef = 1;
  int64_t teacher_agent_steps = 100'000'000;
  bool norm_adv = true;  // normalizes advantages in each minibatch
  FilterThreshold adv_filter = FilterThreshold::maximum;
  double adv_filter_threshold = 0.01;  // for maximum: fraction of the running max |advantage|; 0: keeps all
  double adv_filter_quantile = 0.5;    // for quantile: share of the valid transitions that is dropped
  double adv_filter_ema = 0.25;        // weight of the newest rollout in the running maximum or quantile
  int64_t checkpoint_every = 20;       // interval of checkpoints in updates
  double checkpoint_minutes = 2;       // also saves a checkpoint after this time
  int64_t keep_checkpoints = 1;  // number of kept checkpoints: the newest, and earlier ones as checkpoint.1.ckpt, ...
  int64_t milestone_agent_steps = 0;  // interval of additional checkpoints that are never deleted; 0: none
  // Small evaluations during a run, see training/run_evaluation.h.
  int64_t evaluate_every = 0;  // interval in updates; 0: never
  int evaluate_scenarios = 16, evaluate_agents = 120, evaluate_steps = 600;
  Precision precision = Precision::bf16;
  bool reproducible = false;  // bitwise identical results in every run on a device, see policy/precision.h
  /// Storage of a rollout's images. kept: images stay in memory. redrawn: images are drawn again from the rollout's
  /// scenes when they are read. auto: redrawn if they would take more than two fifths of a CUDA device's memory, else
  /// kept.
  std::string images = "auto";
  std::string graphs = "auto";                   // use of CUDA graphs for learning: auto or off
  HaltedSlots halted_slots = HaltedSlots::skip;  // draw is only for measurements; it draws every slot at every step
};

}  // namespace pictura
