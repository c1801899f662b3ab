// The average of weights: compared with values computed by hand, over a run, in its files and evaluations, and after
// resuming.
#include "pictura/training/weight_average.h"

#include <cmath>

#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/averaged_runs.h"

namespace pictura {
namespace {

using test::are_equal;
using test::message_of;
using test::read_table;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

void set_weights(const Policy& policy, double value) {
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : policy.parameters()) parameter.value.fill_(value);
}

Config averaged_config() {
  Config config;
  config.policy.modality = Modality::vector;
  config.policy.embedding_width = 4;
  config.policy.backbone_width = 8;
  return config;
}

TEST(WeightAverage, IsFirstAMeanThenExponential) {
  const PolicyNetwork policy(averaged_config().policy, 4, 1);
  WeightAverage average(policy, 2);  // the newest weights count 1 - 2^(-1/2) = .2929 from the fourth update on
  EXPECT_TRUE(are_equal(average.values, policy.parameters()));
  const auto value_after = [&](double parameters) {
    set_weights(policy, parameters);
    average.update();
    EXPECT_EQ(average.values[0].value.min().item<float>(), average.values.back().value.max().item<float>());
    return average.values[0].value.max().item<double>();
  };
  EXPECT_DOUBLE_EQ(value_after(2), 2);  // nothing remains of the weights before the first update
  EXPECT_NEAR(value_after(4), 3, 1e-6);
  EXPECT_NEAR(value_after(9), 5, 1e-6);
  const double fourth = 5 + (1 - std::sqrt(0.5)) * (1 - 5);
  EXPECT_NEAR(value_after(1), fourth, 1e-6);
  EXPECT_NEAR(value_after(1), fourth + (1 - std::sqrt(0.5)) * (1 - fourth), 1e-6);
  EXPECT_EQ(average.updates, 5);
  set_weights(policy, 7);
  average.restart();
  EXPECT_EQ(average.updates, 0);
  EXPECT_TRUE(are_equal(average.values, policy.parameters()));
}

TEST(WeightAverage, AfterItsHalfLifeOldWeightsCountHalf) {
  const PolicyNetwork policy(averaged_config().policy, 4, 1);
  constexpr int kHalfLife = 20;
  WeightAverage average(policy, kHalfLife);
  set_weights(policy, 1);
  for (int i = 0; i < 200; ++i) average.update();
  set_weights(policy, 0);
  for (int i = 0; i < kHalfLife; ++i) average.update();
  EXPECT_NEAR(average.values[0].value.max().item<double>(), 0.5, 1e-5);
}

TEST(WeightAverage, ReplacedWeightsAreRestoredBitwise) {
  const PolicyNetwork policy(averaged_config().policy, 4, 1), other(averaged_config().policy, 4, 2);
  const std::string own = policy.hash();
  {
    const ReplacedWeights replaced(policy, other.parameters());
    EXPECT_EQ(policy.hash(), other.hash());
  }
  EXPECT_EQ(policy.hash(), own);
  EXPECT_NE(policy.hash(), other.hash());
}

class RunWithAverage : public ::testing::Test {
 protected:
  TrainOptions options(const std::string& run, const std::vector<std::string>& more) const {
    return test::small_run(folder_ / run, "cpu", more);
  }
  std::string path(const std::string& file) const { return folder_ / file; }

  test::ScratchFolder folder_;
};

TEST_F(RunWithAverage, LearnsIdenticallyAndSavesTheAverage) {
  const auto [without, with] = test::check_average_by_hand(folder_.path(), "cpu");
  EXPECT_FALSE(std::filesystem::exists(path("without/policy_average.safetensors")));
  EXPECT_TRUE(read_checkpoint(without.checkpoint).average.empty());
  const Checkpoint last = read_checkpoint(with.checkpoint);
  EXPECT_TRUE(are_equal(read_policy(with.checkpoint, /*average=*/true).parameters, last.average));
  export_policy(with.checkpoint, path("exported.safetensors"), {.weights = WeightType::f32, .average = true});
  EXPECT_TRUE(are_equal(read_policy(path("exported.safetensors")).parameters, last.average));
  EXPECT_THAT(message_of([&] { read_policy(without.checkpoint, true); }),
              AllOf(HasSubstr("without/checkpoint.ckpt"), HasSubstr("train.weight_average")));
  EXPECT_THAT(message_of([&] { read_policy(path("with/policy.safetensors"), true); }),
              AllOf(HasSubstr("with/policy.safetensors"), HasSubstr("expected a checkpoint")));
}

TEST_F(RunWithAverage, ResumesExactly) { test::check_average_resumes_exactly(folder_.path(), "cpu"); }

TEST_F(RunWithAverage, MayStartOnResume) {
  train(options("run", {"train.updates=3"}));
  TrainOptions rest = options("run", {"train.weight_average=1"});
  rest.old_run = OldRun::resume;
  std::vector<std::string> notices;
  rest.on_notice = [&notices](const std::string& notice) { notices.push_back(notice); };
  const Checkpoint saved = read_checkpoint(train(rest).checkpoint);
  EXPECT_THAT(notices, Contains("train.weight_average: 0.0 became 1.0"));
  EXPECT_EQ(saved.averaged_updates, 1);
  EXPECT_TRUE(are_equal(saved.average, saved.parameters));
}

TEST_F(RunWithAverage, EvaluationsWithinTheRunMeasureBoth) {
  const TrainReport report =
      train(options("run", {"train.weight_average=2", "train.evaluate_every=4", "train.evaluate_scenarios=2",
                            "train.evaluate_agents=3", "train.evaluate_steps=10"}));
  EXPECT_EQ(report.policy_hash, train(options("without", {})).policy_hash);
  const std::vector<std::vector<std::string>> table = read_table(path("run/evaluation.csv"));
  ASSERT_EQ(table.size(), 2u);
  EvaluateOptions o = test::one_scenario(report.checkpoint, 10);
  o.scenarios = 2;
  o.agents_per_world = 3;
  std::vector<double> km;
  for (const auto& [group, average] : {std::pair{"evaluation", false}, std::pair{"evaluation_average", true}}) {
    o.average = average;
    const EvaluateReport evaluated = evaluate(o);
    km.push_back(evaluated.rows.at(0).km_driven);
    for (const auto& [name, estimate] : metrics_of(evaluated.rows.at(0))) {
      const auto at = std::find(table[0].begin(), table[0].end(), fmt::format("{}/{}", group, name)) - table[0].begin();
      EXPECT_EQ(table[1].at(static_cast<size_t>(at)), fmt::format("{:.9g}", estimate.value)) << group << " " << name;
    }
  }
  EXPECT_NE(km[0], km[1]);
}

}  // namespace
}  // namespace pictura
