// A task that a tiny vector policy learns in seconds.
#pragma once

#include "pictura/backends/make_learner.h"
#include "pictura/common/rng.h"
#include "pictura/policy/rules/choose_action.h"
#include "pictura/training/ppo.h"
#include "pictura/training/schedule.h"

namespace pictura::test {

// Task without a simulator. The ego vector shows a sign (1 or -1). The action kGo has no immediate reward, but in the
// next step, the right action for the sign is rewarded.
struct Corridor {
  static constexpr int64_t kSlots = 128, kSteps = 8;
  static constexpr int kGo = 7;

  Rollout rollout;
  at::Tensor open = at::zeros({kSlots}, at::kFloat), sign = at::ones({kSlots}, at::kFloat);

  const std::unique_ptr<LearnerExecutor> executor = make_learner_executor(Device{});
  const uint64_t seed;

  explicit Corridor(uint64_t its_seed = 9)
      : rollout(RolloutObservations(storage()), kSteps, kSlots, Device{}), seed(its_seed) {}

  UpdateStats update(const Policy& policy, const TrainSection& train, int64_t number, Optimizer* optimizer,
                     AdvantageFilter* filter) {
    const UpdateKey key{seed, number, learning_rate_at(train, 0)};
    ChunkRunner runner(policy, rollout.observations);
    return ppo_update({&runner, executor.get(), optimizer, filter}, &rollout, train, key);
  }

  static Observation storage() {
    const int64_t rows = kSteps + 1;
    Observation o;
    o.ego = at::zeros({rows, kSlots, kEgoFeatures}, at::kFloat);
    o.conditioning = at::zeros({rows, kSlots, kNumConditioning}, at::kFloat);
    o.waypoints = at::zeros({rows, kSlots, kNumWaypoints * kWaypointFeatures}, at::kFloat);
    o.partners = at::zeros({rows, kSlots, 1, kPartnerFeatures}, at::kFloat);
    o.lanes = at::zeros({rows, kSlots, 1, kLaneFeatures}, at::kFloat);
    o.boundaries = at::zeros({rows, kSlots, 1, kBoundaryFeatures}, at::kFloat);
    o.controls = at::zeros({rows, kSlots, 1, kControlFeatures}, at::kFloat);
    o.set_counts = at::zeros({rows, kSlots, kNumEntitySets}, at::kInt);
    return o;
  }

  // Plays one rollout, and returns the mean reward per step.
  double play(const Policy& policy, int64_t update) {
    for (int64_t t = 0; t <= kSteps; ++t) {
      const Observation row = row_of(rollout.observations.arrays(), t);
      at::Tensor ego = row.ego;
      ego.select(1, 0).copy_(sign);
      ego.select(1, 1).copy_(open);
      const Decision decision = decide(at::arange(kSlots), {50}, [&](const at::Tensor& slots) {
        return policy.forward(row.map([&](const at::Tensor& all) { return all.index_select(0, slots); }));
      });
      rollout.values.select(0, t).copy_(decision.value);
      if (t == kSteps) break;
      rollout.valid[t].fill_(1);
      const float* const log_probs = decision.log_probs.const_data_ptr<float>();
      float *const is_open = open.data_ptr<float>(), *const signs = sign.data_ptr<float>();
      int32_t* const actions = rollout.actions[t].data_ptr<int32_t>();
      float *const kept_log_probs = rollout.log_probs[t].data_ptr<float>(), *const rewards =
                                                                                rollout.rewards[t].data_ptr<float>();
      for (int64_t slot = 0; slot < kSlots; ++slot) {
        RandomStream stream({.seed = seed,
                             .agent = static_cast<uint32_t>(slot),
                             .episode = static_cast<uint32_t>(update),
                             .step = static_cast<uint32_t>(t),
                             .purpose = Purpose::action});
        const float* const of_slot = log_probs + slot * kNumActions;
        const int action = draw_action(of_slot, kNumActions, stream.uniform());
        const int right = signs[slot] > 0 ? 2 : 10;
        actions[slot] = action;
        kept_log_probs[slot] = of_slot[action];
        rewards[slot] = is_open[slot] > 0 && action == right ? 1.0f : 0.0f;
        is_open[slot] = is_open[slot] <= 0 && action == kGo ? 1.0f : 0.0f;
        signs[slot] = stream.below(2) ? 1.0f : -1.0f;
      }
    }
    return rollout.rewards.mean().item<double>();
  }
};

}  // namespace pictura::test
