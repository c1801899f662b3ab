// Rollout: observations, actions and results of all slots, on the learning device. The first dimension is the step.
#pragma once

#include "pictura/common/scene_history.h"
#include "pictura/policy/observation.h"
#include "pictura/training/kept_images.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

/// Observations of all slots at each step. Images are kept, or drawn again from stored scenes at each read. For the
/// paper's rollout, images take 163 GB and scenes 0.25 GB.
class RolloutObservations {
 public:
  /// Allocates train.num_steps + 1 steps. The pointers must outlive this object. `timer` measures the drawing of kept
  /// images. `renderer` may be null for policies without images.
  RolloutObservations(const Config& config, Simulator* simulator, Renderer* renderer, PhaseTimer* timer);
  /// Creates observations without images, [num_steps + 1, slots, ...].
  explicit RolloutObservations(Observation arrays) : arrays_(std::move(arrays)) {}

  /// Replaces the renderer by one with equally many cameras, and discards kept images.
  void set_renderer(Renderer* renderer);

  /// Records the simulator's present observations as those of `step`. slots: i64 [n], the slots whose images are kept.
  /// The first rollout must record its steps in order.
  void record(int64_t step, const at::Tensor& slots);

  /// Returns the observations of the given rows. rows: i64 [batch], each step * num_slots + slot. Their agents must
  /// have been active. patch_px: see draw_images(); kept images ignore it.
  Observation gather(const at::Tensor& rows, int patch_px = 0) const;

  bool keep_images() const { return kept_images_ != nullptr; }
  bool draws_when_gathered() const { return scenes_ != nullptr; }
  /// Whether every step has been recorded. From then on, until generation() changes, gather() uses memory at fixed
  /// addresses, as does record() if images are not kept.
  bool are_complete() const { return are_complete_; }
  /// Number of times that memory of images has moved.
  uint64_t generation() const {
    return (renderer_ ? renderer_->generation() : 0) + (kept_images_ ? kept_images_->generation() : 0);
  }

  const Observation& arrays() const { return arrays_; }

 private:
  void keep_images_of(const Rig& rig);

  Observation arrays_;  // [num_steps + 1, slots, ...]
  Simulator* simulator_ = nullptr;
  Renderer* renderer_ = nullptr;
  PhaseTimer* timer_ = nullptr;
  bool are_complete_ = false;
  int decision_steps_ = 1;
  std::unique_ptr<KeptImages> kept_images_;
  std::unique_ptr<SceneHistory> scenes_;  // null if images are not drawn again
};

struct Rollout {
  RolloutObservations observations;         // num_steps + 1 steps; the last follows the last action
  at::Tensor values;                        // f32 [num_steps + 1, num_slots]; 0 for inactive agents
  at::Tensor actions;                       // i32 [num_steps, num_slots]; members below: same shape
  at::Tensor log_probs;                     // f32, of `actions`
  at::Tensor rewards;                       // f32
  at::Tensor terminated, truncated, valid;  // u8, as StepResult defines them
  at::Tensor decides;                       // u8; 0: the last action is repeated; undefined if that never happens
  at::Tensor advantages;                    // f32, see rules/gae.h
  at::Tensor teacher_log_probs;             // f32 [num_steps, num_slots, kNumActions]; undefined without a teacher
  at::Tensor teacher_scene;                 // f32 [num_steps, num_slots, width]; undefined if teacher_scene_coef is 0

  Rollout(RolloutObservations its_observations, int64_t num_steps, int64_t num_slots, Device device);
  int64_t num_steps() const { return actions.size(0); }
  int64_t num_slots() const { return actions.size(1); }

  /// Valid transitions with a newly selected action, u8 [num_steps, num_slots].
  at::Tensor decisions() const { return decides.defined() ? valid * decides : valid; }
  at::Tensor rows_of(int64_t step, const at::Tensor& slots) const { return slots + step * num_slots(); }
  /// Memory for the actions of one step, [num_slots].
  Span<int32_t> actions_at(int64_t step);
  /// Records a result that is in the memory of `device`.
  void set_result(int64_t step, const StepResult& result, Device device);
  void compute_advantages(double gamma, double gae_lambda, LearnerExecutor* executor);
};

}  // namespace pictura
