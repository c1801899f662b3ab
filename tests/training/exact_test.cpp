// All of training except the network's arithmetic gives the same bits in two runs, with any number of threads, and
// whether images are stored or drawn again. exact_device_test.cpp compares a CUDA device with these results.
#include <map>

#include <gtest/gtest.h>

#include "pictura/tests/training/exact_policy.h"

namespace pictura {
namespace {

using test::exact_config;
using test::ExactRun;
using test::run_exactly;

class Exact : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { run_ = new ExactRun(run_exactly(exact_config("cpu", {"run.num_threads=1"}))); }
  static void TearDownTestSuite() {
    delete run_;
    run_ = nullptr;
    set_reproducible(false);
  }
  static const ExactRun& once() { return *run_; }

 private:
  static inline const ExactRun* run_ = nullptr;
};

int64_t sum_of(const ExactRun& run, const std::string& name) {
  int64_t sum = 0;
  for (const ExactRun::Update& update : run.updates) {
    for (const NamedTensor& tensor : update.rollout) {
      if (tensor.name == name) sum += tensor.value.sum().item<int64_t>();
    }
  }
  return sum;
}

TEST_F(Exact, TheRunIncludesAllEventsOfTransitions) {
  const SimulatorTotals& totals = once().totals;
  EXPECT_GT(totals.episodes, 0) << "worlds are reset";
  EXPECT_GT(totals.at_fault_collisions, 0);
  EXPECT_GT(totals.collisions, totals.at_fault_collisions) << "some are hit by others";
  EXPECT_GT(totals.off_road, 0);
  EXPECT_GT(totals.red_light, 0);
  EXPECT_GT(totals.wall_contacts, 0);
  EXPECT_GT(sum_of(once(), "terminated"), 0);
  EXPECT_GT(sum_of(once(), "truncated"), 0);
  std::map<float, int64_t> log_probs;
  for (const ExactRun::Update& update : once().updates) {
    EXPECT_GT(update.kept_fraction, 0.1);
    EXPECT_LT(update.kept_fraction, 0.9);
    EXPECT_GT(update.learnt.size(), 10u);
    const at::Tensor valid = update.rollout[6].value.to(at::kBool);
    ASSERT_EQ(update.rollout[1].name, "log_probs");
    ASSERT_EQ(update.rollout[6].name, "valid");
    const at::Tensor of_valid = update.rollout[1].value.masked_select(valid);
    for (int64_t i = 0; i < of_valid.size(0); ++i) ++log_probs[of_valid[i].item<float>()];
  }
  // The logarithms of 1, 2, 4 and 8 as every device rounds them.
  ASSERT_EQ(log_probs.size(), 4u);
  for (const float of_one : {0.0f, -0.693147182f, -1.38629436f, -2.07944155f}) EXPECT_GT(log_probs[of_one], 100);
}

TEST_F(Exact, ImagesRedrawnByMoreThreadsEqualKeptImages) {
  const ExactRun redrawn = run_exactly(exact_config("cpu", {"run.num_threads=3", "train.images=redrawn"}));
  test::expect_same_driving(once(), redrawn);
  test::expect_same_order(once(), redrawn);
}

TEST_F(Exact, TwoRunsOfOneSeedAreEqual) {
  const auto run = [](const char* seed, const char* threads) {
    return run_exactly(exact_config("cpu", {"policy.modality=vector", seed, threads}));
  };
  const ExactRun one = run("run.seed=8", "run.num_threads=1"), again = run("run.seed=8", "run.num_threads=3");
  test::expect_same_driving(one, again);
  test::expect_same_order(one, again);
  EXPECT_NE(run("run.seed=2", "run.num_threads=1").simulator_hash, one.simulator_hash);
  EXPECT_NE(once().simulator_hash, one.simulator_hash) << "images are read";
}

}  // namespace
}  // namespace pictura
