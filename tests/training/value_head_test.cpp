// Heads of the critic: what their outputs mean, their losses, and that each of them learns.
#include "pictura/policy/value_head.h"

#include <cmath>

#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/tests/policy/numbers.h"
#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/corridor.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/ppo.h"

namespace pictura {
namespace {

const at::TensorOptions kDoubles(at::kDouble);

TEST(ValueHead, SymlogIsALogarithmOfBothSigns) {
  const at::Tensor x = at::tensor({-400.0, -1.0, 0.0, 1e-9, std::exp(1.0) - 1}, kDoubles), y = symlog(x);
  EXPECT_NEAR(y[0].item<double>(), -std::log(401.0), 1e-12);
  EXPECT_NEAR(y[1].item<double>(), -std::log(2.0), 1e-12);
  EXPECT_EQ(y[2].item<double>(), 0);
  EXPECT_NEAR(y[3].item<double>(), 1e-9, 1e-18);
  EXPECT_NEAR(y[4].item<double>(), 1, 1e-12);
  EXPECT_TRUE(symexp(y).allclose(x, 1e-12, 0));
}

TEST(ValueHead, BinsAreEqualStepsOfSymlog) {
  const at::Tensor bins = value_bins(kDoubles), steps = symlog(bins).diff();
  ASSERT_EQ(bins.size(0), 101);
  EXPECT_NEAR(bins[100].item<double>(), std::exp(6.0) - 1, 1e-9);
  EXPECT_TRUE(bins.allclose(-bins.flip(0), 0, 1e-9));
  EXPECT_TRUE(steps.allclose(at::full_like(steps, 0.12), 0, 1e-12));
}

TEST(ValueHead, TwoBinsShareAValue) {
  const at::Tensor bins = value_bins(kDoubles);
  const double low = bins[60].item<double>(), high = bins[61].item<double>();
  const at::Tensor values = at::stack({at::full({}, 0.75 * low + 0.25 * high, kDoubles), bins[60], bins[0],
                                       at::full({}, -1e6, kDoubles), at::full({}, 1e6, kDoubles)});
  const at::Tensor weights = two_hot(values);
  at::Tensor expected = at::zeros({5, 101}, kDoubles);
  expected[0][60] = 0.75;
  expected[0][61] = 0.25;
  expected[1][60] = expected[2][0] = expected[3][0] = expected[4][100] = 1;
  EXPECT_LT((weights - expected).abs().max().item<double>(), 1e-12);
}

TEST(ValueHead, TheMeanOfTwoBinsIsTheValue) {
  const at::Tensor values = at::cat({at::linspace(-402, 402, 4001, at::kFloat), at::linspace(-2, 2, 4001, at::kFloat)});
  const at::Tensor means = (two_hot(values) * value_bins(values.options())).sum(1);
  EXPECT_LT(((means - values).abs() / (1 + values.abs())).max().item<double>(), 1e-5);
  // Probabilities that are the weights: the head's outputs are their logarithms.
  EXPECT_TRUE(values_of(ValueHead::two_hot, two_hot(values).clamp_min(1e-30).log()).allclose(means, 1e-4, 1e-4));
  EXPECT_NEAR(values_of(ValueHead::two_hot, at::zeros({1, 101}, kDoubles)).item<double>(), 0, 1e-9);
}

TEST(ValueHead, OtherHeadsGiveOneNumber) {
  const at::Tensor outputs = at::tensor({1.0, -2.0}, kDoubles).view({2, 1});
  EXPECT_TRUE(values_of(ValueHead::linear, outputs).equal(outputs.squeeze(1)));
  EXPECT_NEAR(values_of(ValueHead::symlog, outputs)[1].item<double>(), 1 - std::exp(2.0), 1e-12);
}

/// The value's loss of two rows, whose returns are -3 and .75 of the way from bin 70 to bin 71.
struct LossOfHead {
  at::Tensor outputs, returns;
  double loss = 0;

  LossOfHead(ValueHead head, const at::Tensor& its_outputs) : outputs(its_outputs.clone().requires_grad_(true)) {
    const at::Tensor bins = value_bins(kDoubles);
    returns = at::stack({at::full({}, -3.0, kDoubles), 0.25 * bins[70] + 0.75 * bins[71]});
    const Targets targets{at::zeros({2}, at::kLong), at::zeros({2}, kDoubles), returns};
    const at::AutoGradMode mode(true);
    const Minibatch chunk{at::arange(2), 2, at::zeros({2}, kDoubles), {}};
    const Losses losses = ppo_losses({at::zeros({2, kNumActions}, kDoubles), values_of(head, outputs), outputs, head},
                                     targets, chunk, TrainSection{});
    losses.value.backward();
    loss = losses.value.item<double>();
  }
};

TEST(ValueHead, SquaredErrorsAreOfValuesOrOfTheirSymlog) {
  const at::Tensor outputs = at::tensor({-1.0, 5.0}, kDoubles).view({2, 1});
  const LossOfHead linear(ValueHead::linear, outputs), symlog_loss(ValueHead::symlog, outputs);
  const double high = linear.returns[1].item<double>();
  EXPECT_NEAR(linear.loss, 0.25 * (4 + std::pow(5 - high, 2)), 1e-12);
  EXPECT_NEAR(symlog_loss.loss, 0.25 * (std::pow(std::log(4.0) - 1, 2) + std::pow(5 - std::log1p(high), 2)), 1e-12);
  EXPECT_NEAR(symlog_loss.outputs.grad()[0].item<double>(), 0.5 * (std::log(4.0) - 1), 1e-12);
}

TEST(ValueHead, CrossEntropyIsOfTheTwoBins) {
  const at::Tensor outputs = test::numbers({2, 101}, 3);
  const LossOfHead head(ValueHead::two_hot, outputs);
  const at::Tensor log_p = at::log_softmax(outputs, 1), weights = two_hot(head.returns);
  const double of_second = -0.25 * log_p[1][70].item<double>() - 0.75 * log_p[1][71].item<double>();
  const double of_first = -(weights[0] * log_p[0]).sum().item<double>();
  EXPECT_NEAR(head.loss, 0.5 * (of_first + of_second), 1e-12);
  EXPECT_LT((head.outputs.grad() - 0.5 * (log_p.exp() - weights)).abs().max().item<double>(), 1e-12);
}

class EachValueHead : public ::testing::TestWithParam<ValueHead> {};
INSTANTIATE_TEST_SUITE_P(ValueHead, EachValueHead,
                         ::testing::Values(ValueHead::linear, ValueHead::symlog, ValueHead::two_hot),
                         [](const auto& tested) { return name_of(tested.param); });

TEST_P(EachValueHead, LearnsReturns) {
  at::set_num_threads(1);
  const at::AutoGradMode mode(true);
  PolicySection section = test::learning_section();
  section.value_head = GetParam();
  const PolicyNetwork policy(section, 1, 7);
  TrainSection train;
  train.minibatch_size = 256;
  train.learning_rate = 3e-3;
  train.schedule = Schedule::constant;
  train.gamma = 0.9;
  train.update_epochs = 4;
  train.adv_filter_threshold = 0;
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  test::Corridor corridor;
  UpdateStats first, last;
  double reward = 0;
  for (int64_t update = 0; update < 40; ++update) {
    reward = corridor.play(policy, update);
    if (update == 0 && GetParam() != ValueHead::linear) {
      EXPECT_LT(corridor.rollout.values.abs().max().item<float>(), 1);
    }
    // Ten times the reward: of a size at which symlog presses together.
    corridor.rollout.rewards *= 10;
    last = corridor.update(policy, train, update, &optimizer, &filter);
    if (update == 0) first = last;
  }
  EXPECT_GT(reward, 0.4) << "of 0.5 at most";
  EXPECT_LT(first.explained_variance, 0.2);
  EXPECT_GT(last.explained_variance, 0.5);
  EXPECT_GT(corridor.rollout.values.mean().item<double>(), 10) << "in units of rewards";
}

TEST(ValueHead, ARunGoesOnExactly) {
  const test::ScratchFolder folder;
  const auto hashes = test::policies_of_equal_runs(
      folder.path(), "cpu", {"policy.modality=vector", "policy.value_head=two_hot", "train.adv_filter=quantile"});
  EXPECT_EQ(hashes[1], hashes[0]);
  EXPECT_EQ(hashes[2], hashes[0]);
}

}  // namespace
}  // namespace pictura
