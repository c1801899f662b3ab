// Section [train] of a configuration.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

/// Arithmetic of the network on a CUDA device, see policy/precision.h.
enum class Precision { fp32, tf32, bf16 };

/// Treatment of halted and absent agents. skip: they are neither drawn nor encoded. draw: they are, but the policy does
/// not learn from them.
enum class HaltedSlots { skip, draw };

/// Decay of the learning rate to 0.
enum class Schedule { constant, linear, cosine };

/// See training/optimizer.h.
enum class OptimizerKind { adamw, muon };

/// Threshold of the advantage filter, see training/rules/advantage_filter.h.
enum class FilterThreshold { maximum, quantile };

struct TrainSection {
  int64_t updates = 19074;  // length of the run
  // See training/schedule.h.
  Schedule schedule = Schedule::cosine;
  int64_t schedule_agent_steps = 50'000'000'000;
  int64_t decay_agent_steps = 0;  // length of the decay at the end of the schedule; 0: the whole schedule
  int64_t warm_up_agent_steps = 0;
  int num_steps = 128;            // per rollout
  bool stagger_episodes = false;  // see max_steps_of()
  int64_t minibatch_size = 65536;
  int update_epochs = 2;
  int64_t forward_chunk = 2048;  // transitions per pass through the network
  double gamma = 0.999, gae_lambda = 0.95;
  double clip_coef = 0.2;
  double policy_coef = 1, vf_coef = 0.5, ent_coef = 0.01;
  OptimizerKind optimizer = OptimizerKind::adamw;
  double learning_rate = 5e-4;
  double adam_beta1 = 0.9, adam_beta2 = 0.999, adam_eps = 1e-8, weight_decay = 0.01;
  double max_grad_norm = 0.5;
  // Half-life, in updates, of the averaged weights (training/weight_average.h); 0: no average.
  double weight_average = 0;
  // Agent-steps in which the policy's logits double (training/schedule.h); 0: never.
  int64_t sharpen_agent_steps = 0;
  /// Path of a saved policy that the learner imitates (training/teacher.h), relative to the configuration's
  /// folder. The weight of the KL loss falls linearly from teacher_coef to 0 over teacher_agent_steps.
  std::string teacher;
  double teacher_coef = 1;
  int64_t teacher_agent_steps = 100'000'000;
  /// Constant weight of the distance between the learner's and the teacher's scene embeddings (Policy::Output::scene).
  double teacher_scene_coef = 0;
  bool norm_adv = true;  // per minibatch
  FilterThreshold adv_filter = FilterThreshold::maximum;
  double adv_filter_threshold = 0.01;  // for maximum: fraction of the running maximum of |advantage|; 0: keeps all
  double adv_filter_quantile = 0.5;    // for quantile: share of valid transitions that is dropped
  double adv_filter_ema = 0.25;        // weight of the newest rollout in the running value
  int64_t checkpoint_every = 20;       // in updates
  double checkpoint_minutes = 2;       // maximum time between checkpoints
  int64_t keep_checkpoints = 1;        // kept checkpoints; earlier ones are checkpoint.1.ckpt, ...
  int64_t milestone_agent_steps = 0;   // interval of checkpoints that are never deleted; 0: none
  // See training/run_evaluation.h.
  int64_t evaluate_every = 0;  // in updates; 0: never
  int evaluate_scenarios = 16, evaluate_agents = 120, evaluate_steps = 600;
  Precision precision = Precision::bf16;
  bool reproducible = false;  // bitwise identical results on a device, see policy/precision.h
  /// Images of a rollout. kept: in memory. redrawn: drawn again from its scenes for learning. auto: redrawn if they
  /// exceed two fifths of a CUDA device's memory.
  std::string images = "auto";
  std::string graphs = "auto";                   // CUDA graphs for learning: auto or off
  HaltedSlots halted_slots = HaltedSlots::skip;  // draw: only for measurements
};

}  // namespace pictura
