// Steps of AdamW and Muon compared with their definitions, and the parameters that each optimizer updates.
#include "pictura/training/optimizer.h"

#include <cmath>

#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/corridor.h"
#include "pictura/tests/training/small_runs.h"

namespace pictura {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A matrix [rows, columns] whose singular values are spread evenly over [.1, 1].
at::Tensor matrix_with_singular_values(int64_t rows, int64_t columns) {
  const at::Tensor left = std::get<0>(at::linalg_qr(at::randn({rows, rows}, at::kDouble)));
  const at::Tensor right = std::get<0>(at::linalg_qr(at::randn({columns, columns}, at::kDouble)));
  const int64_t rank = std::min(rows, columns);
  const at::Tensor values = at::linspace(0.1, 1, rank, at::kDouble);
  return left.narrow(1, 0, rank).mul(values).matmul(right.narrow(0, 0, rank)).to(at::kFloat);
}

void expect_orthogonal(const at::Tensor& matrix) {
  const at::Tensor values = at::linalg_svdvals(matrix.to(at::kDouble));
  EXPECT_GT(values.min().item<double>(), 0.6) << matrix.sizes();
  EXPECT_LT(values.max().item<double>(), 1.3) << matrix.sizes();
}

// Result of five Newton-Schulz steps on a matrix, in double.
at::Tensor newton_schulz(const at::Tensor& matrix) {
  at::Tensor x = matrix.to(at::kDouble);
  x = x / x.norm();
  for (int step = 0; step < 5; ++step) {
    const at::Tensor gram = x.matmul(x.t());
    x = 3.4445 * x + (-4.775 * gram + 2.0315 * gram.matmul(gram)).matmul(x);
  }
  return x;
}

at::Tensor leaf(const at::Tensor& value) {
  at::Tensor result = value.clone();
  result.requires_grad_();
  result.mutable_grad() = at::zeros_like(value);
  return result;
}

TrainSection muon_config() {
  TrainSection train;
  train.optimizer = OptimizerKind::muon;
  return train;
}

TEST(AdamW, StepsMatchTheDefinition) {
  const PolicyNetwork policy(test::tiny_section(Modality::vector), 1, 3);
  TrainSection train;
  train.weight_decay = 0.1;
  train.max_grad_norm = 1e9;
  Optimizer optimizer(policy, train);
  at::Tensor weight = policy.parameters()[0].value;  // all other parameters have no gradient and stay unchanged
  const std::vector<double> gradients{0.5, -0.25};
  const double start = weight.flatten()[0].item<double>();
  double expected = start, m = 0, v = 0;
  for (size_t t = 0; t < gradients.size(); ++t) {
    weight.mutable_grad().fill_(gradients[t]);
    optimizer.step(0.01, at::zeros({}));
    m = 0.9 * m + 0.1 * gradients[t];
    v = 0.999 * v + 0.001 * gradients[t] * gradients[t];
    const double power = static_cast<double>(t) + 1;
    const double m_hat = m / (1 - std::pow(0.9, power)), v_hat = v / (1 - std::pow(0.999, power));
    expected += -0.01 * 0.1 * expected - 0.01 * m_hat / (std::sqrt(v_hat) + 1e-8);
  }
  EXPECT_NEAR(weight.flatten()[0].item<double>(), expected, 1e-6);
  EXPECT_GT(std::abs(expected - start), 1e-3);
}

TEST(AdamW, AFailedStepChangesNothing) {
  const PolicyNetwork policy(test::tiny_section(Modality::vector), 1, 3);
  const std::string before = policy.hash();
  Optimizer optimizer(policy, TrainSection{});
  at::Tensor weight = policy.parameters()[0].value;
  for (const double gradient : {1.0, HUGE_VAL}) {
    weight.mutable_grad().fill_(gradient);
    optimizer.step(0.01, /*failed=*/at::ones({}));
    EXPECT_EQ(policy.hash(), before);
    EXPECT_EQ(optimizer.first_moments[0].value.abs().sum().item<float>(), 0);
  }
  weight.mutable_grad().fill_(1.0);
  optimizer.step(0.01, /*failed=*/at::zeros({}));
  EXPECT_NE(policy.hash(), before);
}

TEST(Muon, GivesSingularValuesNearOne) {
  at::manual_seed(5);
  for (const auto& [rows, columns] : {std::pair{64, 64}, {32, 128}, {512, 384}, {128, 1152}}) {
    const at::Tensor matrix = matrix_with_singular_values(rows, columns).unsqueeze(0);
    expect_orthogonal(orthogonalized(matrix, at::kFloat)[0]);
    expect_orthogonal(orthogonalized(matrix * 1e-6, at::kFloat)[0]);
    expect_orthogonal(orthogonalized(matrix, at::kBFloat16)[0]);
  }
  EXPECT_EQ(orthogonalized(at::zeros({2, 3, 4}), at::kFloat).abs().max().item<float>(), 0);
}

TEST(Muon, StepsMatchTheDefinition) {
  at::manual_seed(5);
  constexpr double kRate = 0.01, kDecay = 0.1;
  // Wide, tall, and a convolution's [out, in, height, width]: small matrices are multiplied together, padded and
  // transposed.
  std::vector<at::Tensor> weights, expected, momenta;
  for (const at::IntArrayRef shape : {at::IntArrayRef{3, 5}, {7, 2}, {4, 2, 3, 3}, {3, 5}}) {
    weights.push_back(leaf(at::randn(shape)));
    expected.push_back(weights.back().detach().to(at::kDouble).flatten(1));
    momenta.push_back(at::zeros_like(expected.back()));
  }
  Muon muon(weights, at::kFloat, kDecay);
  for (int step = 0; step < 2; ++step) {
    for (size_t i = 0; i < weights.size(); ++i) {
      const at::Tensor gradient = at::randn(weights[i].sizes());
      weights[i].mutable_grad().copy_(gradient);
      const at::Tensor g = gradient.to(at::kDouble).flatten(1);
      momenta[i] = 0.95 * momenta[i] + 0.05 * g;
      const at::Tensor direction = 0.05 * g + 0.95 * momenta[i];
      const double larger = static_cast<double>(std::max(g.size(0), g.size(1)));
      const bool is_tall = g.size(0) > g.size(1);
      const at::Tensor turned = newton_schulz(is_tall ? direction.t() : direction);
      expected[i] =
          (1 - kRate * kDecay) * expected[i] - kRate * 0.2 * std::sqrt(larger) * (is_tall ? turned.t() : turned);
    }
    muon.step(kRate, at::zeros({}));
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    EXPECT_LT((weights[i].detach().flatten(1) - expected[i]).abs().max().item<double>(), 1e-5) << i;
    EXPECT_LT((muon.momentum(i).flatten(1) - momenta[i]).abs().max().item<double>(), 1e-6) << i;
  }
}

TEST(Muon, ANonFiniteGradientChangesNothing) {
  at::manual_seed(5);
  const at::Tensor weight = leaf(at::randn({3, 5}));
  Muon muon({weight}, at::kFloat, 0.1);
  weight.mutable_grad().fill_(1.0);
  muon.step(0.01, at::zeros({}));
  const at::Tensor before = weight.detach().clone(), momentum = muon.momentum(0).clone();
  weight.mutable_grad().fill_(std::nan(""));
  muon.step(0.01, at::ones({}));
  EXPECT_TRUE(weight.detach().equal(before));
  EXPECT_TRUE(muon.momentum(0).equal(momentum));
}

// Names of the parameters that AdamW steps beside Muon.
std::vector<std::string> stepped_by_adamw(Modality modality) {
  const PolicyNetwork policy(test::tiny_section(modality), 1, 3);
  std::vector<std::string> names;
  for (const NamedTensor& moment : Optimizer(policy, muon_config()).second_moments) {
    if (!moment.name.ends_with(".bias")) names.push_back(moment.name);
  }
  return names;
}

TEST(Muon, StepsTheWeightsOfHiddenLayers) {
  EXPECT_THAT(stepped_by_adamw(Modality::vector), ElementsAre("actor.weight", "critic.weight"));
  EXPECT_THAT(
      stepped_by_adamw(Modality::perspective),
      ElementsAre("conv.0.weight", "attention.position.weight", "attention.token_norm.weight", "attention.queries",
                  "attention.query_norm.weight", "attention.mlp_norm.weight", "actor.weight", "critic.weight"));
}

TEST(WeightRms, CoversOnlyHiddenLayers) {
  const std::vector<NamedTensor> parameters{{"backbone.0.weight", at::full({2, 2}, 3.0f)},
                                            {"backbone.0.bias", at::full({2}, 50.0f)},
                                            {"conv.1.weight", at::full({2, 1, 2, 1}, -1.0f)},
                                            {"critic.weight", at::full({1, 2}, 100.0f)}};
  const WeightRms rms = weight_rms(parameters);
  EXPECT_DOUBLE_EQ(rms.all, std::sqrt((4 * 9 + 4 * 1) / 8.0));
  EXPECT_DOUBLE_EQ(rms.largest, 3);
  EXPECT_EQ(weight_rms({parameters[3]}).all, 0);
}

TEST(Muon, LearnsATaskWithDelayedReward) {
  at::set_num_threads(1);
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  TrainSection train = muon_config();
  train.minibatch_size = 256;
  train.learning_rate = 3e-3;
  train.schedule = Schedule::constant;
  train.gamma = 0.9;
  train.update_epochs = 4;
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  test::Corridor corridor;
  double reward = 0;
  for (int64_t update = 0; update < 40; ++update) {
    reward = corridor.play(policy, update);
    corridor.update(policy, train, update, &optimizer, &filter);
  }
  EXPECT_GT(reward, 0.3);
}

TEST(Muon, ResumesExactly) {
  for (const char* modality : {"policy.modality=vector", "policy.modality=perspective"}) {
    const test::ScratchFolder folder;
    const auto [whole, again, resumed] =
        test::policies_of_equal_runs(folder / "runs", "cpu", {modality, "train.optimizer=muon", "train.num_steps=6"});
    EXPECT_EQ(whole, again);
    EXPECT_EQ(whole, resumed);
  }
}

TEST(Muon, ResumingARunOfAdamWStartsNewMoments) {
  const test::ScratchFolder folder;
  TrainOptions run = test::small_run(folder / "run", "cpu", {"policy.modality=vector", "train.updates=1"});
  train(run);
  run.old_run = OldRun::resume;
  run.overrides.back() = "train.updates=2";
  run.overrides.push_back("train.optimizer=muon");
  std::vector<std::string> notices;
  run.on_notice = [&notices](const std::string& notice) { notices.push_back(notice); };
  EXPECT_EQ(train(run).updates, 2);
  EXPECT_THAT(notices, ElementsAre(fmt::format("train.optimizer: {} holds moments of adamw: new moments of muon start",
                                               folder / "run/checkpoint.ckpt")));
}

}  // namespace
}  // namespace pictura
