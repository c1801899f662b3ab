// Section [train] of a configuration: learning settings, and the length of a run.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

/// Arithmetic of the network on a CUDA device: IEEE fp32; products in TF32; layers in bf16. See policy/precision.h.
enum class Precision { fp32, tf32, bf16 };

/// Treatment of halted or absent agents: neither drawn nor encoded; or drawn and encoded in rollouts and updates,
/// without learning from them.
enum class HaltedSlots { skip, draw };

/// Decay of the learning rate to 0; `constant` never decays.
enum class Schedule { constant, linear, cosine };

/// Optimizer of the parameters: see training/optimizer.h.
enum class OptimizerKind { adamw, muon };

/// Reference of the advantage filter's threshold, see training/rules/advantage_filter.h: a fraction of the largest
/// |advantage|, or a quantile of |advantages|.
enum class FilterThreshold { maximum, quantile };

struct TrainSection {
  int64_t updates = 19074;  // updates after which the run ends
  // Learning rate, see training/schedule.h.
  Schedule schedule = Schedule::cosine;
  int64_t schedule_agent_steps = 50'000'000'000;
  int64_t decay_agent_steps = 0;  // 0: all agent-steps
  int64_t warm_up_agent_steps = 0;
  int num_steps = 128;            // steps of a rollout
  bool stagger_episodes = false;  // ends the worlds' first episodes at different times, see max_steps_of()
  int64_t minibatch_size = 65536;
  int update_epochs = 2;
  int64_t forward_chunk = 2048;  // transitions in one pass through the network; gradients accumulate
  double gamma = 0.999, gae_lambda = 0.95;
  double clip_coef = 0.2;
  double vf_coef = 0.5, ent_coef = 0.01;
  OptimizerKind optimizer = OptimizerKind::adamw;
  double learning_rate = 5e-4;
  double adam_beta1 = 0.9, adam_beta2 = 0.999, adam_eps = 1e-8, weight_decay = 0.01;
  double max_grad_norm = 0.5;
  double weight_average = 0;        // half-life of the average in updates, see training/weight_average.h; 0: none
  int64_t sharpen_agent_steps = 0;  // interval in which logits double, see training/schedule.h; 0: never
  /// Saved vector policy to imitate, see training/teacher.h. The loss includes the KL divergence from the teacher's
  /// actions times a weight, which falls linearly from teacher_coef to 0 over teacher_agent_steps. The path is relative
  /// to the configuration's folder.
  std::string teacher;
  double teacher_coef = 1;
  int64_t teacher_agent_steps = 100'000'000;
  bool norm_adv = true;  // per minibatch
  FilterThreshold adv_filter = FilterThreshold::maximum;
  double adv_filter_threshold = 0.01;  // maximum: fraction of the running max |advantage|; 0: keeps all
  double adv_filter_quantile = 0.5;    // quantile: share of the valid transitions that is dropped
  double adv_filter_ema = 0.25;        // weight of the newest rollout in the running max or quantile
  int64_t checkpoint_every = 20;       // in updates
  double checkpoint_minutes = 2;       // or as soon as this time has passed
  int64_t keep_checkpoints = 1;        // the newest and its predecessors, as checkpoint.1.ckpt, ...
  int64_t milestone_agent_steps = 0;   // interval of checkpoints that are kept forever; 0: none
  // Small evaluations within a run, see training/run_evaluation.h.
  int64_t evaluate_every = 0;  // in updates; 0: never
  int evaluate_scenarios = 16, evaluate_agents = 120, evaluate_steps = 600;
  Precision precision = Precision::bf16;
  bool reproducible = false;  // gives the same bits in every run on a device, see policy/precision.h
  /// Images of a rollout: kept, or redrawn from its scenes when they are read. auto: kept on the host, and on a device
  /// if they take at most two fifths of its memory.
  std::string images = "auto";
  std::string graphs = "auto";                   // CUDA graphs of a learner's work; off: no graphs
  HaltedSlots halted_slots = HaltedSlots::skip;  // draw: for measurements only, with every slot at every step
};

}  // namespace pictura
