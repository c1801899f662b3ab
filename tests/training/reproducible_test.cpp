// One seed gives one policy: in two runs, in a resumed run, and with every setting for which this is guaranteed.
#include <cstdlib>

#include <ATen/Context.h>
#include <gmock/gmock.h>

#include "pictura/policy/precision.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;

class Reproducible : public ::testing::Test {
 protected:
  ~Reproducible() override {
    unsetenv("CUBLAS_WORKSPACE_CONFIG");
    set_reproducible(false);
  }
  test::ScratchFolder folder_;
};

class EachModality : public Reproducible, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Reproducible, EachModality, ::testing::Values("vector", "perspective"),
                         [](const auto& modality) { return std::string(modality.param); });

// On the host, which has only fp32, each setting gives one policy. train.reproducible may give another policy: it pads
// chunks, and the rounding of a product may depend on its number of rows.
TEST_P(EachModality, HostRunsGiveEqualPoliciesInEachSetting) {
  const auto policies = [this](const std::string& precision, const std::string& reproducible) {
    return test::policies_of_equal_runs(folder_ / (precision + reproducible), "cpu",
                                        {std::string("policy.modality=") + GetParam(), "train.precision=" + precision,
                                         "train.reproducible=" + reproducible, "train.num_steps=6"});
  };
  const auto fp32 = policies("fp32", "false"), tf32 = policies("tf32", "false"), filled = policies("bf16", "true");
  EXPECT_THAT(fp32, Each(fp32[0]));
  EXPECT_THAT(tf32, Each(fp32[0]));
  EXPECT_THAT(filled, Each(filled[0]));
  const TrainReport other = train(test::small_run(
      folder_ / "other", "cpu", {std::string("policy.modality=") + GetParam(), "train.updates=2", "run.seed=2"}));
  EXPECT_NE(other.policy_hash, fp32[0]) << "the seed counts";
}

// Convolutions of few channels use oneDNN, others our own products, whose sums are per thread.
TEST_F(Reproducible, HostRunsGiveEqualPoliciesWithWideConvolutionsAndTwoThreads) {
  const auto [whole, again, resumed] = test::policies_of_equal_runs(
      folder_ / "wide", "cpu", {"policy.conv_channels=[16, 24]", "run.num_threads=2", "train.num_steps=6"});
  EXPECT_EQ(whole, again);
  EXPECT_EQ(whole, resumed);
}

TEST_F(Reproducible, SelectsDeterministicAlgorithmsAndDisablesTheAutotuner) {
  const at::Context& torch = at::globalContext();
  set_reproducible(true);
  EXPECT_TRUE(torch.deterministicAlgorithms());
  EXPECT_FALSE(torch.deterministicAlgorithmsWarnOnly());
  EXPECT_TRUE(torch.deterministicCuDNN());
  EXPECT_STREQ(std::getenv("CUBLAS_WORKSPACE_CONFIG"), ":4096:8");
  {
    const Autotuner autotuner;
    EXPECT_FALSE(torch.benchmarkCuDNN());
  }
  set_reproducible(false);
  EXPECT_FALSE(torch.deterministicAlgorithms());
  EXPECT_FALSE(torch.deterministicCuDNN());
  EXPECT_FALSE(torch.benchmarkCuDNN()) << "rollouts go without";
  {
    const Autotuner autotuner;
    EXPECT_TRUE(torch.benchmarkCuDNN());
  }
  EXPECT_FALSE(torch.benchmarkCuDNN());
}

TEST_F(Reproducible, ANondeterministicCublasWorkspaceIsRefused) {
  setenv("CUBLAS_WORKSPACE_CONFIG", ":0:0", 1);
  EXPECT_THAT(message_of([] { set_reproducible(true); }),
              AllOf(HasSubstr("train.reproducible"), HasSubstr("CUBLAS_WORKSPACE_CONFIG"), HasSubstr("got \":0:0\"")));
  setenv("CUBLAS_WORKSPACE_CONFIG", ":16:8", 1);
  set_reproducible(true);
  EXPECT_STREQ(std::getenv("CUBLAS_WORKSPACE_CONFIG"), ":16:8");
}

TEST_F(Reproducible, MayChangeOnResumeWithANotice) {
  TrainOptions run = test::small_run(folder_ / "run", "cpu", {"policy.modality=vector", "train.updates=1"});
  train(run);
  run.old_run = OldRun::resume;
  run.overrides.push_back("train.reproducible=true");
  std::vector<std::string> notices;
  run.on_notice = [&notices](const std::string& notice) { notices.push_back(notice); };
  train(run);
  EXPECT_THAT(notices, ::testing::ElementsAre("train.reproducible: false became true"));
}

}  // namespace
}  // namespace pictura
