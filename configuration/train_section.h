// [train] of a configuration: what learns, and for how long.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

/// Arithmetic of the network on a CUDA device: IEEE fp32; products in TF32; layers in bf16. See policy/precision.h.
enum class Precision { fp32, tf32, bf16 };

/// What becomes of agents that are halted or absent: they are neither drawn nor encoded; or they are, in rollouts and
/// updates, and nothing is learnt from them.
enum class HaltedSlots { skip, draw };

/// How the learning rate falls to 0, or not.
enum class Schedule { constant, linear, cosine };

/// What steps the parameters: see training/optimizer.h.
enum class OptimizerKind { adamw, muon };

/// What the advantage filter's threshold follows, see training/rules/advantage_filter.h: a fraction of the largest
/// |advantage|, or a quantile of them.
enum class FilterThreshold { maximum, quantile };

struct TrainSection {
  int64_t updates = 19074;  // when to stop
  // The learning rate, see training/schedule.h.
  Schedule schedule = Schedule::cosine;
  int64_t schedule_agent_steps = 50'000'000'000;
  int64_t decay_agent_steps = 0;  // 0: all of them
  int64_t warm_up_agent_steps = 0;
  int num_steps = 128;            // steps of a rollout
  bool stagger_episodes = false;  // the worlds' first episodes end at different times, see max_steps_of()
  int64_t minibatch_size = 65536;
  int update_epochs = 2;
  int64_t forward_chunk = 2048;  // transitions that go through the network at once; gradients accumulate
  double gamma = 0.999, gae_lambda = 0.95;
  double clip_coef = 0.2;
  double vf_coef = 0.5, ent_coef = 0.01;
  OptimizerKind optimizer = OptimizerKind::adamw;
  double learning_rate = 5e-4;
  double adam_beta1 = 0.9, adam_beta2 = 0.999, adam_eps = 1e-8, weight_decay = 0.01;
  double max_grad_norm = 0.5;
  double weight_average = 0;  // half-life in updates of the average of weights, see training/weight_average.h; 0: none
  int64_t sharpen_agent_steps = 0;  // over so many the policy's logits double, see training/schedule.h; 0: never
  /// A saved vector policy to imitate, see training/teacher.h: the loss has the KL divergence from its actions times
  /// teacher_coef, which falls to 0 along a line over so many agent-steps. Relative to the configuration's folder.
  std::string teacher;
  double teacher_coef = 1;
  int64_t teacher_agent_steps = 100'000'000;
  bool norm_adv = true;  // per minibatch
  FilterThreshold adv_filter = FilterThreshold::maximum;
  double adv_filter_threshold = 0.01;  // maximum: of the running max |advantage|; 0: keep everything
  double adv_filter_quantile = 0.5;    // quantile: share of the valid transitions that is dropped
  double adv_filter_ema = 0.25;        // weight of the newest rollout in the running max or quantile
  int64_t checkpoint_every = 20;       // updates
  double checkpoint_minutes = 2;       // or as soon as these have passed
  int64_t keep_checkpoints = 1;        // the newest and those before it, as checkpoint.1.ckpt, ...
  int64_t milestone_agent_steps = 0;   // distance of checkpoints that are kept for ever; 0: none
  // Small evaluations within a run, see training/run_evaluation.h.
  int64_t evaluate_every = 0;  // updates; 0: never
  int evaluate_scenarios = 16, evaluate_agents = 120, evaluate_steps = 600;
  Precision precision = Precision::bf16;
  bool reproducible = false;  // the same bits in every run on a device, see policy/precision.h
  /// Images of a rollout: kept, or redrawn from its scenes where they are read; auto: kept on the host,
  /// and on a device where they take at most two fifths of its memory.
  std::string images = "auto";
  std::string graphs = "auto";                   // CUDA graphs of a learner's work; off: call by call
  HaltedSlots halted_slots = HaltedSlots::skip;  // draw: for measuring alone, with every slot at every step
};

}  // namespace pictura
