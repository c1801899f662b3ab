// Rollout: observations, actions and results of all slots of a simulator, as tensors on the learning device. The first
// dimension of each tensor is the step.
#pragma once

#include "pictura/common/scene_history.h"
#include "pictura/policy/observation.h"
#include "pictura/training/kept_images.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

/// Observations of all slots at each step. Images of agents that select a new action are kept, or drawn again from
/// stored scenes whenever they are read. Drawing again saves memory: the images of the paper's rollout would take 163
/// GB, but the scenes take 0.25 GB.
class RolloutObservations {
 public:
  /// Allocates train.num_steps + 1 steps of this simulator. The simulator, the renderer and the timer must outlive this
  /// object. The timer measures the drawing of images that are kept. Policies without images need no renderer.
  /// training/memory.h estimates the memory.
  RolloutObservations(const Config& config, Simulator* simulator, Renderer* renderer, PhaseTimer* timer);
  /// Creates observations without images. arrays: [num_steps + 1, slots, ...].
  explicit RolloutObservations(Observation arrays) : arrays_(std::move(arrays)) {}

  /// Replaces the renderer. The new renderer's rig must have the same number of cameras. Kept images are lost.
  void set_renderer(Renderer* renderer);

  /// Records the simulator's present observations as those of `step`. slots: i64 [n], the slots whose images are kept.
  /// The first rollout must record its steps in order.
  void record(int64_t step, const at::Tensor& slots);

  /// Gathers the observations of rows. rows: i64 [batch] of step * slots + slot; the agents must have been active at
  /// these steps. patch_px: side of patches, as in draw_images() (policy/observation.h); applies only to images that
  /// are drawn again.
  Observation gather(const at::Tensor& rows, int patch_px = 0) const;

  /// Whether images are kept when they are drawn.
  bool keep_images() const { return kept_images_ != nullptr; }
  /// Whether gather() draws images.
  bool draws_when_gathered() const { return scenes_ != nullptr; }
  /// Whether every step has been recorded. From then on, gather() uses the same memory in each call until generation()
  /// changes. So does record() if no images are kept.
  bool are_complete() const { return are_complete_; }
  /// Number of times that the memory of the renderer or of kept images has moved.
  uint64_t generation() const {
    return (renderer_ ? renderer_->generation() : 0) + (kept_images_ ? kept_images_->generation() : 0);
  }

  /// Observations without images.
  const Observation& arrays() const { return arrays_; }

 private:
  void keep_images_of(const Rig& rig);

  Observation arrays_;  // [num_steps + 1, slots, ...], without images
  Simulator* simulator_ = nullptr;
  Renderer* renderer_ = nullptr;
  PhaseTimer* timer_ = nullptr;
  bool are_complete_ = false;
  int decision_steps_ = 1;
  std::unique_ptr<KeptImages> kept_images_;
  std::unique_ptr<SceneHistory> scenes_;  // scenes of images that are drawn again; null if none are
};

struct Rollout {
  RolloutObservations observations;         // num_steps + 1 steps; the last one follows the last action
  at::Tensor values;                        // f32 [num_steps + 1, num_slots]; 0 for agents that were not active
  at::Tensor actions;                       // i32 [num_steps, num_slots], like members below without a shape
  at::Tensor log_probs;                     // f32, log-probabilities of `actions`
  at::Tensor rewards;                       // f32
  at::Tensor terminated, truncated, valid;  // u8, as StepResult defines them
  at::Tensor decides;            // u8; 0 where an agent repeats its last action; undefined if agents never do so
  at::Tensor advantages;         // f32, see rules/gae.h
  at::Tensor teacher_log_probs;  // f32 [num_steps, num_slots, kNumActions]; undefined without a teacher

  Rollout(RolloutObservations its_observations, int64_t num_steps, int64_t num_slots, Device device);
  int64_t num_steps() const { return actions.size(0); }
  int64_t num_slots() const { return actions.size(1); }

  /// Returns the steps to learn from, u8 [num_steps, num_slots]: valid steps at which the agent selected a new action.
  at::Tensor decisions() const { return decides.defined() ? valid * decides : valid; }
  /// Returns the rows of `slots`, i64 [n], at a step.
  at::Tensor rows_of(int64_t step, const at::Tensor& slots) const { return slots + step * num_slots(); }
  /// Returns the actions of one step, [num_slots], for the caller to fill in.
  Span<int32_t> actions_at(int64_t step);
  /// Records the results of a step, which are in the memory of `device`.
  void set_result(int64_t step, const StepResult& result, Device device);
  /// Fills `advantages` from rewards, values and flags.
  void compute_advantages(double gamma, double gae_lambda, LearnerExecutor* executor);
};

}  // namespace pictura
