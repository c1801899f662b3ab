// A policy whose arithmetic is exact on every device, so that other parts of training can be compared bit for bit. Also
// records of its runs.
#pragma once

#include <ATen/ATen.h>
#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gtest/gtest.h>

#include "pictura/common/support/parallel_for.h"
#include "pictura/policy/precision.h"
#include "pictura/training/collector.h"

namespace pictura::test {

/// Sums every bit of the observation as integers. The sum selects the value, and the 1, 2, 4 or 8 equally probable
/// actions. Agents with some conditioning values always drive straight ahead, so that they make progress.
class ExactPolicy final : public Policy {
 public:
  explicit ExactPolicy(Device device) {
    const at::TensorOptions options = at::TensorOptions(at::kFloat).device(torch_device(device));
    parameters_.push_back({"shift", at::zeros({1}, options).requires_grad_()});
  }

  Output forward(const Observation& o) const override {
    const at::Tensor shift = parameters_[0].value;
    at::Tensor logits, value;
    {
      const bool learns = at::GradMode::is_enabled();
      const at::NoGradGuard no_grad;
      const at::Tensor character = mixed(bits_of(o.conditioning)), salt = (4 * shift).to(at::kLong);
      at::Tensor sum = character + 3 * bits_of(o.ego) + 5 * bits_of(o.waypoints) + 7 * salt;
      for (const ImageBlock& block : o.images) sum = sum + 11 * weighted(block.pixels.flatten(1).to(at::kLong));
      const at::Tensor hash = mixed(sum);
      if (learns) learnt_.push_back(hash);

      const at::Tensor drives = part(character, 40, 2) < 3;
      const at::Tensor first = part(hash, 8, 16).remainder(kNumActions).masked_fill(drives, kStraightOn),
                       size = at::ones_like(hash).bitwise_left_shift(part(hash, 30, 2)).masked_fill(drives, 1);
      const at::Tensor from_first =
          (at::arange(kNumActions, hash.options()) - first.unsqueeze(1)).remainder(kNumActions);
      // exp(-200) is 0 in single precision.
      logits = at::zeros_like(from_first, at::kFloat).masked_fill(from_first >= size.unsqueeze(1), -200);
      value = part(hash, 36, 16).to(at::kFloat) * (1.0 / 4096) - 8.0;
    }
    return {logits + shift, value + shift};
  }

  void step() {
    const at::NoGradGuard no_grad;
    parameters_[0].value += 0.25;
  }
  /// Returns a hash of each row that the policy has learned from since the last call, grouped by calls of forward().
  std::vector<at::Tensor> take_learnt() { return std::exchange(learnt_, {}); }

 private:
  static constexpr int64_t kStraightOn = (kNumLongActions - 1) * kNumLatActions + 1;  // largest jerk, no steering

  static at::Tensor weighted(const at::Tensor& numbers) {
    const at::Tensor weights = at::arange(1, 2 * numbers.size(1), 2, numbers.options()) * 0x2545f4914f6cdd1d;
    return (numbers * weights).sum(1);
  }
  static at::Tensor bits_of(const at::Tensor& floats) { return weighted(floats.view(at::kInt).to(at::kLong)); }
  // The rounds of SplitMix64's finalizer, but with arithmetic right shifts.
  static at::Tensor mixed(at::Tensor x) {
    x = x.bitwise_xor(x.bitwise_right_shift(30)) * -4658895280553007687;
    x = x.bitwise_xor(x.bitwise_right_shift(27)) * -7723592293110705685;
    return x.bitwise_xor(x.bitwise_right_shift(31));
  }
  static at::Tensor part(const at::Tensor& x, int64_t begin, int64_t bits) {
    return x.bitwise_right_shift(begin).bitwise_and((int64_t{1} << bits) - 1);
  }

  mutable std::vector<at::Tensor> learnt_;
};

/// Records of three updates, in host memory.
struct ExactRun {
  struct Update {
    std::vector<NamedTensor> rollout;
    std::vector<at::Tensor> images;  // images of some agents
    std::vector<at::Tensor> learnt;  // see ExactPolicy::take_learnt()
    double kept_fraction = 0, adv_threshold = 0;
  };
  std::vector<Update> updates;
  SimulatorTotals totals;
  uint64_t simulator_hash = 0;
  int64_t graph_launches = 0;
};

/// Returns a configuration whose seed produces every event that exact_test.cpp requires.
inline Config exact_config(const std::string& device, const std::vector<std::string>& more) {
  std::vector<std::string> overrides{"run.device=" + device,
                                     device == "cpu" ? "render.backend=cpu" : "render.backend=auto",
                                     "run.seed=8",
                                     "render.width_px=8",
                                     "render.height_px=6",
                                     "simulator.num_slots=144",
                                     "simulator.min_agents=30",
                                     "simulator.max_agents=40",
                                     "simulator.pedestrian_fraction=0.3",
                                     "simulator.cyclist_fraction=0.1",
                                     "simulator.walls=true",
                                     "simulator.parked_cars=8",
                                     "simulator.episode_steps=55",
                                     "train.num_steps=40",
                                     "train.forward_chunk=64",
                                     "train.minibatch_size=64",
                                     "train.adv_filter_threshold=0.2",
                                     "train.learning_rate=0",
                                     "train.schedule=constant",
                                     "train.reproducible=true"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", overrides);
}

inline ExactRun run_exactly(const Config& config) {
  const Device device = open_learning_device(config);
  at::set_num_threads(resolve_num_threads(config.run.num_threads));
  set_reproducible(config.train.reproducible);
  auto made = std::make_unique<ExactPolicy>(device);
  ExactPolicy* const policy = made.get();
  Run run(config, device, single_communicator(), std::move(made));
  run.simulator->reset();
  Collector collector(&run);
  ExactRun result;
  for (; run.update < 3; ++run.update) {
    EXPECT_TRUE(collector.collect());
    const UpdateStats stats = run.update_policy();
    const Rollout& rollout = run.rollout;
    ExactRun::Update update;
    update.kept_fraction = stats.kept_fraction;
    update.adv_threshold = stats.adv_threshold;
    for (const auto& [name, tensor] : {std::pair<const char*, at::Tensor>{"actions", rollout.actions},
                                       {"log_probs", rollout.log_probs},
                                       {"values", rollout.values},
                                       {"rewards", rollout.rewards},
                                       {"terminated", rollout.terminated},
                                       {"truncated", rollout.truncated},
                                       {"valid", rollout.valid},
                                       {"advantages", rollout.advantages}}) {
      update.rollout.push_back({name, tensor.cpu().clone()});
    }
    const at::Tensor active = at::nonzero(rollout.valid.flatten()).squeeze(1);
    const at::Tensor some = active.index_select(0, at::arange(0, active.size(0), 7, active.options()));
    for (const ImageBlock& block : rollout.observations.gather(some).images) {
      update.images.push_back(block.pixels.cpu().clone());
    }
    for (const at::Tensor& learnt : policy->take_learnt()) update.learnt.push_back(learnt.cpu());
    result.updates.push_back(std::move(update));
    policy->step();
  }
  result.totals = run.simulator->totals();
  result.simulator_hash = run.simulator->state_hash();
  result.graph_launches = run.graphs.num_launches() + collector.num_graph_launches();
  return result;
}

inline void expect_same_driving(const ExactRun& a, const ExactRun& b) {
  ASSERT_EQ(a.updates.size(), b.updates.size());
  for (size_t u = 0; u < a.updates.size(); ++u) {
    SCOPED_TRACE("update " + std::to_string(u + 1));
    const ExactRun::Update &x = a.updates[u], &y = b.updates[u];
    for (size_t i = 0; i < x.rollout.size(); ++i) {
      EXPECT_TRUE(x.rollout[i].value.equal(y.rollout[i].value)) << x.rollout[i].name;
    }
    ASSERT_EQ(x.images.size(), y.images.size());
    for (size_t i = 0; i < x.images.size(); ++i) EXPECT_TRUE(x.images[i].equal(y.images[i]));
    EXPECT_EQ(x.kept_fraction, y.kept_fraction);
    EXPECT_EQ(x.adv_threshold, y.adv_threshold);
  }
  EXPECT_EQ(a.simulator_hash, b.simulator_hash);
}

/// Checks that two runs learned from the same transitions in the same order. Longer chunks are padded.
inline void expect_same_order(const ExactRun& a, const ExactRun& b) {
  for (size_t u = 0; u < a.updates.size(); ++u) {
    SCOPED_TRACE("update " + std::to_string(u + 1));
    const std::vector<at::Tensor>&x = a.updates[u].learnt, &y = b.updates[u].learnt;
    ASSERT_EQ(x.size(), y.size());
    for (size_t i = 0; i < x.size(); ++i) {
      const int64_t size = std::min(x[i].size(0), y[i].size(0));
      EXPECT_TRUE(x[i].narrow(0, 0, size).equal(y[i].narrow(0, 0, size))) << "minibatch " << i;
      for (const at::Tensor& rows : {x[i], y[i]}) EXPECT_TRUE(rows.slice(0, size).eq(rows[0]).all().item<bool>());
    }
  }
}

}  // namespace pictura::test
