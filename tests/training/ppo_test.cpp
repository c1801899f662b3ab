// PPO: advantages, the advantage filter, the schedule, shuffles, and learning on a small task.
#include "pictura/training/ppo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/backends/make_learner.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/policy/rules/choose_action.h"
#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/training/corridor.h"
#include "pictura/training/rules/advantage_filter.h"
#include "pictura/training/schedule.h"

namespace pictura {
namespace {

using test::Corridor;

// One agent, the recursion as in the literature.
std::vector<float> plain_gae(const std::vector<float>& rewards, const std::vector<float>& values,
                             const std::vector<uint8_t>& terminated, const std::vector<uint8_t>& truncated,
                             const std::vector<uint8_t>& valid, float gamma, float gae_lambda) {
  std::vector<float> advantages(rewards.size());
  float later = 0;
  for (size_t t = rewards.size(); t-- > 0;) {
    if (!valid[t]) {
      later = 0;
    } else if (terminated[t]) {
      later = rewards[t] + gamma * 0.0f - values[t] + gamma * gae_lambda * 0.0f;
    } else {
      const float delta = rewards[t] + gamma * values[t + 1] - values[t];
      later = delta + gamma * gae_lambda * (truncated[t] ? 0.0f : later);
    }
    advantages[t] = later;
  }
  return advantages;
}

// Advantages of a rollout that consists of these numbers. [num_steps * num_slots], except values, which have one more
// row.
std::vector<float> advantages_of(int64_t num_steps, int64_t num_slots, const std::vector<float>& rewards,
                                 const std::vector<float>& values, const std::vector<uint8_t>& terminated,
                                 const std::vector<uint8_t>& truncated, const std::vector<uint8_t>& valid, double gamma,
                                 double gae_lambda) {
  Rollout rollout(RolloutObservations(Observation{}), num_steps, num_slots, Device{});
  std::copy(rewards.begin(), rewards.end(), rollout.rewards.data_ptr<float>());
  std::copy(values.begin(), values.end(), rollout.values.data_ptr<float>());
  std::copy(terminated.begin(), terminated.end(), rollout.terminated.data_ptr<uint8_t>());
  std::copy(truncated.begin(), truncated.end(), rollout.truncated.data_ptr<uint8_t>());
  std::copy(valid.begin(), valid.end(), rollout.valid.data_ptr<uint8_t>());
  rollout.compute_advantages(gamma, gae_lambda, make_learner_executor(Device{}).get());
  const float* first = rollout.advantages.const_data_ptr<float>();
  return {first, first + num_steps * num_slots};
}

TEST(Gae, EqualsThePlainRecursionExactly) {
  const size_t num_steps = 37, num_slots = 53;
  RandomStream stream({.seed = 1, .world = 2, .agent = 3, .episode = 4, .step = 5, .purpose = Purpose::initial_state});
  std::vector<float> rewards(num_steps * num_slots), values((num_steps + 1) * num_slots);
  std::vector<uint8_t> terminated(rewards.size()), truncated(rewards.size()), valid(rewards.size());
  for (float& x : rewards) x = stream.uniform(-1, 1);
  for (float& x : values) x = stream.uniform(-1, 1);
  for (size_t i = 0; i < rewards.size(); ++i) {
    terminated[i] = stream.below(9) == 0;
    truncated[i] = stream.below(9) == 0;
    valid[i] = stream.below(5) != 0;
  }
  const std::vector<float> advantages =
      advantages_of(num_steps, num_slots, rewards, values, terminated, truncated, valid, 0.97f, 0.9f);
  auto column = [&](const auto& all, size_t slot) {
    std::decay_t<decltype(all)> one;
    for (size_t i = slot; i < all.size(); i += num_slots) one.push_back(all[i]);
    return one;
  };
  for (size_t slot = 0; slot < num_slots; ++slot) {
    EXPECT_EQ(column(advantages, slot), plain_gae(column(rewards, slot), column(values, slot), column(terminated, slot),
                                                  column(truncated, slot), column(valid, slot), 0.97f, 0.9f));
  }
}

TEST(Gae, BootstrapsTruncationsButNotTerminationsAndMasksResets) {
  // One slot, gamma 0.5, lambda 1. Step 1 ends the episode, step 2 is the reset, step 3 begins the next episode.
  const std::vector<float> rewards{1, 2, 100, 4}, values{10, 20, 40, 80, 160};
  const std::vector<uint8_t> never{0, 0, 0, 0}, end{0, 1, 0, 0}, valid{1, 1, 0, 1};
  std::vector<float> advantages = advantages_of(4, 1, rewards, values, never, end, valid, 0.5, 1.0);
  EXPECT_EQ(advantages[3], 4 + 80 - 80);
  EXPECT_EQ(advantages[2], 0);
  EXPECT_EQ(advantages[1], 2 + 20 - 20);  // bootstraps from the final observation's value, 40
  EXPECT_EQ(advantages[0], 1 + 10 - 10 + 0.5f * 2);
  advantages = advantages_of(4, 1, rewards, values, end, never, valid, 0.5, 1.0);
  EXPECT_EQ(advantages[1], 2 - 20);
  EXPECT_EQ(advantages[0], 1 + 10 - 10 + 0.5f * (2 - 20));
}

TEST(AdvantageFilter, FollowsTheExponentialAverageOfTheMaxima) {
  double average = AdvantageFilter{}.average;
  for (const auto& [newest, expected] : {std::pair{8.0f, 8.0}, {4.0f, 0.25 * 4 + 0.75 * 8}, {0.0f, 0.75 * 7}}) {
    average = filter_average(average, newest, 0.25);
    EXPECT_DOUBLE_EQ(average, expected);
  }
  EXPECT_EQ(filter_threshold(average, 0.01), 0.0525f);
}

// Bins of 1, 2, 3 and 4 begin at these numbers.
TEST(AdvantageFilter, QuantilesLieInTheBinsOfTheCounts) {
  EXPECT_EQ(filter_bin(0), 0);
  EXPECT_EQ(filter_bin(-0.0f), 0);
  EXPECT_EQ(filter_bin(1), filter_bin(-1));
  EXPECT_EQ(filter_bin(1) + 128, filter_bin(2));
  EXPECT_EQ(filter_bin(-1.0078124f), filter_bin(1));
  EXPECT_EQ(filter_bin(1.0078125f), filter_bin(1) + 1);
  EXPECT_EQ(filter_bin(std::numeric_limits<float>::max()), kNotFiniteBin - 1);
  EXPECT_EQ(filter_bin(-std::numeric_limits<float>::infinity()), kNotFiniteBin);
  EXPECT_EQ(filter_bin(std::nanf("")), kNotFiniteBin);

  std::vector<int64_t> counts(kNumFilterBins);
  EXPECT_EQ(filter_quantile(counts, 0.5), 0);
  const std::vector<float> advantages{4, -1, 3, -2, 1000};
  const std::vector<uint8_t> valid{1, 1, 1, 1, 0};
  make_learner_executor(Device{})->count_advantages(advantages, valid, counts);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), int64_t{0}), 4);
  EXPECT_EQ(filter_quantile(counts, 0), 1);
  EXPECT_EQ(filter_quantile(counts, 0.25), 2);
  EXPECT_EQ(filter_quantile(counts, 0.5), 3);
  EXPECT_FLOAT_EQ(filter_quantile(counts, 0.3), 2 + 0.2f * 2 / 128) << "a fifth of the one in its bin, 1.2 of 4";
}

TEST(AdvantageFilter, QuantileMatchesSortedAdvantages) {
  std::vector<float> advantages;
  RandomStream stream({.seed = 3, .purpose = Purpose::initial_state});
  for (int i = 0; i < 20000; ++i) advantages.push_back(std::exp(stream.uniform(-6, 3)) * (stream.below(2) ? 1 : -1));
  std::vector<int64_t> counts(kNumFilterBins);
  make_learner_executor(Device{})->count_advantages(advantages, std::vector<uint8_t>(advantages.size(), 1), counts);
  for (float& advantage : advantages) advantage = std::abs(advantage);
  std::sort(advantages.begin(), advantages.end());
  for (const double share : {0.01, 0.3, 0.5, 0.9, 0.99}) {
    const float exact = advantages[share * static_cast<double>(advantages.size())];
    EXPECT_NEAR(filter_quantile(counts, share), exact, 0.003f * exact) << share;
  }
}

TEST(AdvantageFilter, DropsTheShareOfItsQuantile) {
  at::set_num_threads(1);
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  TrainSection train;
  train.adv_filter = FilterThreshold::quantile;
  Corridor corridor;
  corridor.play(policy, 0);
  corridor.rollout.valid.narrow(1, 0, 40).zero_();
  for (const double share : {0.0, 0.3, 0.8}) {
    train.adv_filter_quantile = share;
    corridor.rollout.rewards.copy_(
        at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
    // A single very large reward, which would move the maximum, does not matter.
    corridor.rollout.rewards[7][127] = 1e6;
    Optimizer optimizer(policy, train);
    AdvantageFilter filter;
    const UpdateStats stats = corridor.update(policy, train, 0, &optimizer, &filter);
    EXPECT_NEAR(stats.kept_fraction, 1 - share, 0.01);
    EXPECT_EQ(stats.adv_threshold, filter.average);
  }
  corridor.rollout.rewards[7][127] = std::numeric_limits<float>::infinity();
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  EXPECT_THROW(corridor.update(policy, train, 0, &optimizer, &filter), Error);
}

TEST(LossStats, ARowStoresEachNamedValue) {
  LossTensors tensors;
  std::map<std::string, double> written;
  LossTensors::visit_losses(tensors, [&written](const char* name, at::Tensor& tensor) {
    written[name] = 1.5 * static_cast<double>(written.size() + 1);
    tensor = at::full({}, written[name], at::kFloat);
  });
  const at::Tensor row = at::zeros({kNumLossStats}, at::kDouble);
  row.narrow(0, 0, kNumLossStats - 1).copy_(stacked(tensors));
  elements_of(row).grad_norm.fill_(written["grad_norm"] = 100);
  const LossStats numbers = numbers_of(row);
  std::map<std::string, double> read;
  LossStats::visit(numbers, [&read](const char* name, double number) { read[name] = number; });
  EXPECT_EQ(read, written);
  EXPECT_EQ(numbers.entropy, written.at("entropy"));
  EXPECT_EQ(numbers.teacher_kl, written.at("teacher_kl"));
  EXPECT_EQ(numbers.scene, written.at("scene"));
  EXPECT_EQ(read.size(), static_cast<size_t>(kNumLossStats));
}

TEST(Schedule, FallsToZeroOverItsLastPart) {
  TrainSection train;
  train.learning_rate = 2;
  train.schedule_agent_steps = 100;
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 0), 2);
  EXPECT_NEAR(learning_rate_at(train, 25), 1 + std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(learning_rate_at(train, 100), 0, 1e-12);
  EXPECT_NEAR(learning_rate_at(train, 150), 0, 1e-12);
  train.schedule = Schedule::linear;
  train.decay_agent_steps = 20;
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 80), 2);
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 95), 0.5);
  EXPECT_FALSE(schedule_has_ended(train, 99));
  EXPECT_TRUE(schedule_has_ended(train, 100));
  train.schedule = Schedule::constant;
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 1000), 2);
  EXPECT_FALSE(schedule_has_ended(train, 1000));
}

TEST(Schedule, DoublesLogitsOverTheConfiguredAgentSteps) {
  TrainSection train;
  EXPECT_EQ(logit_growth(train, 1000), 1);
  train.sharpen_agent_steps = 100;
  EXPECT_DOUBLE_EQ(logit_growth(train, 100), 2);
  EXPECT_DOUBLE_EQ(logit_growth(train, 30) * logit_growth(train, 70), 2);
}

TEST(Schedule, WarmUpStartsAtATenth) {
  TrainSection train;
  train.learning_rate = 2;
  train.schedule = Schedule::constant;
  train.warm_up_agent_steps = 10;
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 0), 0.2);
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 5), 1.1);
  EXPECT_DOUBLE_EQ(learning_rate_at(train, 10), 2);
}

TEST(Permutation, VisitsEveryElementOnceAndDependsOnlyOnItsArguments) {
  for (const int64_t size : {1, 2, 3, 4, 5, 17, 1000, 4096, 70001}) {
    std::vector<int64_t> taken;
    const Permutation permutation(1, 2, 3, size);
    for (int64_t i = 0; i < size; ++i) taken.push_back(permutation(i));
    std::sort(taken.begin(), taken.end());
    for (int64_t i = 0; i < size; ++i) ASSERT_EQ(taken[i], i) << "of " << size;
  }
  const auto order = [](uint64_t seed, int64_t update, int64_t epoch) {
    const Permutation permutation(seed, update, epoch, 1000);
    std::vector<int64_t> taken;
    for (int64_t i = 0; i < 1000; ++i) taken.push_back(permutation(i));
    return taken;
  };
  const std::vector<int64_t> a = order(1, 2, 3);
  EXPECT_EQ(a, order(1, 2, 3));
  EXPECT_NE(a, order(1, 2, 4));
  EXPECT_NE(a, order(1, 3, 3));
  EXPECT_NE(a, order(2, 2, 3));
}

TEST(Permutation, MixesWell) {
  // Neighbours get unrelated positions, and every position is equally likely.
  constexpr int64_t kSize = 5000, kParts = 10;
  int64_t neighbours = 0, counts[kParts] = {};
  double distance = 0;
  for (int64_t epoch = 0; epoch < 20; ++epoch) {
    const Permutation permutation(7, 0, epoch, kSize);
    ++counts[permutation(0) * kParts / kSize];
    for (int64_t i = 0; i + 1 < kSize; ++i) {
      const int64_t step = std::abs(permutation(i + 1) - permutation(i));
      neighbours += step == 1;
      distance += static_cast<double>(step) / static_cast<double>(20 * (kSize - 1));
    }
  }
  EXPECT_LT(neighbours, 100);  // 40 expected
  // The mean distance of two independent uniform places is a third of the range.
  EXPECT_NEAR(distance, static_cast<double>(kSize) / 3, kSize / 100.0);
  EXPECT_LT(*std::max_element(counts, counts + kParts), 9);  // 2 expected
}

TEST(DrawAction, FollowsTheCumulativeProbabilities) {
  const float log_probs[] = {std::log(0.25f), std::log(0.5f), std::log(0.25f)};
  EXPECT_EQ(draw_action(log_probs, 3, 0.0f), 0);
  EXPECT_EQ(draw_action(log_probs, 3, 0.24f), 0);
  EXPECT_EQ(draw_action(log_probs, 3, 0.26f), 1);
  EXPECT_EQ(draw_action(log_probs, 3, 0.74f), 1);
  EXPECT_EQ(draw_action(log_probs, 3, 0.9999999f), 2);
}

TEST(Ppo, LearnsATaskWithDelayedReward) {
  at::set_num_threads(1);
  const at::AutoGradMode mode(true);
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  TrainSection train;
  train.minibatch_size = 256;
  train.forward_chunk = 100;
  train.learning_rate = 3e-3;
  train.schedule = Schedule::constant;
  train.gamma = 0.9;
  train.update_epochs = 4;
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  Corridor corridor;
  double first = 0, last = 0;
  UpdateStats stats;
  for (int64_t update = 0; update < 40; ++update) {
    last = corridor.play(policy, update);
    if (update == 0) first = last;
    stats = corridor.update(policy, train, update, &optimizer, &filter);
  }
  // Chance is 1/12 of 1/13; perfect play is paid every other step.
  EXPECT_LT(first, 0.05);
  EXPECT_GT(last, 0.4);
  EXPECT_GT(stats.kept_fraction, 0.0);
}

TEST(Ppo, ChunksChangeOnlyRounding) {
  at::set_num_threads(1);
  const PolicySection section = test::learning_section();
  const PolicyNetwork whole(section, 1, 7), chunked(section, 1, 7);
  TrainSection train;
  train.minibatch_size = 512;
  for (const Policy* policy : {&whole, &chunked}) {
    train.forward_chunk = policy == &whole ? 100000 : 60;
    Corridor corridor;
    corridor.play(*policy, 0);
    corridor.rollout.rewards.copy_(
        at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
    Optimizer optimizer(*policy, train);
    AdvantageFilter filter;
    corridor.update(*policy, train, 0, &optimizer, &filter);
  }
  for (size_t i = 0; i < whole.parameters().size(); ++i) {
    const at::NoGradGuard no_grad;
    EXPECT_LT((whole.parameters()[i].value - chunked.parameters()[i].value).abs().max().item<double>(), 2e-4);
  }
}

// Policy that records the number of transitions of each of its forward passes.
class CountedPolicy final : public Policy {
 public:
  explicit CountedPolicy(const Policy* policy) : policy_(*policy) { parameters_ = policy->parameters(); }
  Output forward(const Observation& observation) const override {
    sizes.push_back(observation.ego.size(0));
    return policy_.forward(observation);
  }
  mutable std::vector<int64_t> sizes;

 private:
  const Policy& policy_;
};

TEST(Ppo, SparseDiagnosticsMeasureGradientsOfEachLoss) {
  at::set_num_threads(1);
  const PolicyNetwork network(test::learning_section(), 1, 7);
  const CountedPolicy policy(&network);
  TrainSection train;
  train.minibatch_size = 512;
  train.forward_chunk = 128;  // no chunk needs padding
  train.update_epochs = 4;
  train.adv_filter_threshold = 0;
  Corridor corridor;
  corridor.play(policy, 0);
  corridor.rollout.rewards.copy_(
      at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  policy.sizes.clear();
  const UpdateStats stats = corridor.update(policy, train, 0, &optimizer, &filter);
  ASSERT_FALSE(stats.rejected);
  ASSERT_GT(policy.sizes.size(), 5u);
  EXPECT_EQ(policy.sizes[0], 8 * 128 * 4 / 100);
  EXPECT_EQ(std::accumulate(policy.sizes.begin() + 1, policy.sizes.begin() + 5, int64_t{0}), 512);
  EXPECT_EQ(std::accumulate(policy.sizes.begin() + 1, policy.sizes.end(), int64_t{0}), 8 * 128 * 4)
      << "each transition is passed over once an epoch";
  EXPECT_GT(stats.gradient_norms.policy, 0);
  EXPECT_GT(stats.gradient_norms.value, 0);
  EXPECT_GT(stats.gradient_norms.entropy, 0);
}

TEST(Ppo, InvalidTransitionsDoNotAffectLearning) {
  at::set_num_threads(1);
  const PolicySection section = test::learning_section();
  const PolicyNetwork a(section, 1, 7), b(section, 1, 7);
  TrainSection train;
  for (const Policy* policy : {&a, &b}) {
    Corridor corridor;
    corridor.play(*policy, 0);
    corridor.rollout.rewards.copy_(
        at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
    corridor.rollout.valid.narrow(1, 0, 40).zero_();
    if (policy == &b) corridor.rollout.rewards.narrow(1, 0, 40).fill_(50);
    Optimizer optimizer(*policy, train);
    AdvantageFilter filter;
    const UpdateStats stats = corridor.update(*policy, train, 0, &optimizer, &filter);
    EXPECT_LT(stats.kept_fraction, 1.0001);
  }
  EXPECT_EQ(a.hash(), b.hash());
}

TEST(Ppo, StopsBeforeTheStepOfANonFiniteMinibatch) {
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  const std::string before = policy.hash();
  Corridor corridor;
  corridor.play(policy, 0);
  corridor.rollout.rewards.copy_(
      at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
  corridor.rollout.log_probs[3][5] = std::nan("");
  const int64_t bad_row = 3 * Corridor::kSlots + 5;
  for (const int64_t minibatch_size : {100000, 100}) {
    TrainSection train;
    train.minibatch_size = minibatch_size;
    Optimizer optimizer(policy, train);
    AdvantageFilter filter;
    try {
      corridor.update(policy, train, 0, &optimizer, &filter);
      FAIL() << "expected an Error";
    } catch (const NotFinite& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("update 1, epoch 1, minibatch "));
      std::map<std::string, at::Tensor> kept;
      for (const NamedTensor& tensor : error.minibatch) kept[tensor.name] = tensor.value;
      const at::Tensor at_bad_row = kept.at("rows") == bad_row;
      EXPECT_EQ(at_bad_row.sum().item<int64_t>(), 1);
      EXPECT_TRUE(kept.at("log_probs").isnan().equal(at_bad_row));
      EXPECT_TRUE(kept.at("ego").equal(
          corridor.rollout.observations.arrays().ego.flatten(0, 1).index_select(0, kept.at("rows"))));
      for (const char* name : {"actions", "advantages", "returns", "waypoints", "lanes"}) {
        EXPECT_EQ(kept.at(name).size(0), at_bad_row.size(0)) << name;
      }
    }
    if (minibatch_size > bad_row) {
      EXPECT_EQ(policy.hash(), before);
    }
    for (const NamedTensor& parameter : policy.parameters()) {
      EXPECT_TRUE(parameter.value.isfinite().all().item<bool>()) << parameter.name;
    }
  }
}

// Both rollouts hold log-probabilities that differ from the policy's: the update uses the policy's own.
TEST(Ppo, DifferingLogProbabilitiesAreRecomputed) {
  at::set_num_threads(1);
  TrainSection train;
  train.minibatch_size = 200;
  train.forward_chunk = 60;
  std::vector<std::string> policies;
  for (const double error : {0.0, 5e-4, 2e-3, 0.5}) {
    SCOPED_TRACE(error);
    const PolicyNetwork policy(test::learning_section(), 1, 7);
    Corridor corridor;
    corridor.play(policy, 0);
    corridor.rollout.rewards.copy_(
        at::arange(corridor.rollout.rewards.numel(), at::kFloat).sin().reshape_as(corridor.rollout.rewards));
    corridor.rollout.log_probs += error;
    const at::Tensor kept = corridor.rollout.log_probs.clone();
    Optimizer optimizer(policy, train);
    AdvantageFilter filter;
    const UpdateStats stats = corridor.update(policy, train, 0, &optimizer, &filter);
    EXPECT_TRUE(corridor.rollout.log_probs.equal(kept)) << "the rollout stays as it was";
    EXPECT_EQ(stats.rejected.has_value(), error > kMaxAbsLogRatio);
    if (!stats.rejected) {
      EXPECT_NEAR(stats.first.abs_log_ratio, error, 1e-5);
      continue;
    }
    EXPECT_NEAR(stats.rejected->abs_log_ratio, error, 1e-5);
    EXPECT_NEAR(stats.rejected->clip_fraction, error > 0.2 ? 1 : 0, 1e-6);
    EXPECT_EQ(stats.first.abs_log_ratio, 0);
    EXPECT_EQ(stats.first.clip_fraction, 0);
    EXPECT_GT(stats.gradient_norms.policy, 0);
    policies.push_back(policy.hash());
  }
  ASSERT_EQ(policies.size(), 2u);
  EXPECT_EQ(policies[0], policies[1]);
}

TEST(Ppo, NanIsAnError) {
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  TrainSection train;
  Corridor corridor;
  corridor.play(policy, 0);
  corridor.rollout.rewards.fill_(1);
  {
    const at::NoGradGuard no_grad;
    at::Tensor bias = policy.parameters().back().value;
    bias.fill_(std::nan(""));
  }
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  try {
    corridor.update(policy, train, 4, &optimizer, &filter);
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                ::testing::HasSubstr("update 5, epoch 1, minibatch 1: the loss or its gradient is not finite"));
  }
}

TEST(Ppo, ANonFiniteGradientIsAnError) {
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  const std::string before = policy.hash();
  Corridor corridor;
  corridor.play(policy, 0);
  corridor.rollout.rewards.fill_(1);
  const auto as_infinities = [](const at::Tensor& gradient) { return gradient.abs() * HUGE_VAL; };
  policy.parameters().back().value.register_hook(as_infinities);
  const TrainSection train;
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  EXPECT_THROW(corridor.update(policy, train, 0, &optimizer, &filter), NotFinite);
  EXPECT_EQ(policy.hash(), before);
}

}  // namespace
}  // namespace pictura
