// A teacher, which is a policy to imitate: its loss, its requirements for a run, and that a policy learns to act like
// it.
#include "pictura/training/teacher.h"

#include <algorithm>

#include <gmock/gmock.h>

#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/ppo.h"
#include "pictura/training/schedule.h"

namespace pictura {
namespace {

using test::read_table;
using test::small_run;

TEST(Teacher, LossIsTheWeightedDivergenceFromItsActions) {
  const auto doubles = at::TensorOptions(at::kDouble);
  const at::Tensor logits = at::tensor({0.3, -1.0, 2.0, 0.5, 0.0, -0.2}, doubles).view({2, 3}).requires_grad_(true);
  const at::Tensor teacher = at::tensor({.7, .2, .1, .1, .1, .8, .3, .3, .4}, doubles).view({3, 3});
  Targets targets{at::zeros({3}, at::kLong), at::zeros({3}, doubles), at::zeros({3}, doubles)};
  targets.teacher_log_probs = teacher.log();
  targets.teacher_weight = at::full({}, 0.25, doubles);
  const at::Tensor rows = at::tensor({2, 0}, at::kLong);
  TrainSection train;
  train.ent_coef = 0;  // policy and value have no loss if advantages, returns and values are 0
  const Losses losses =
      ppo_losses({logits, at::zeros({2}, doubles)}, targets, {rows, 2, at::zeros({2}, doubles), /*shares=*/{}}, train);
  const at::Tensor p = teacher.index_select(0, rows), q = at::softmax(logits, 1);
  const double divergence = (p * (p / q).log()).sum(1).mean().item<double>();
  EXPECT_NEAR(losses.total.item<double>(), 0.25 * divergence, 1e-12);
  EXPECT_NEAR(elements_of(at::constant_pad_nd(losses.stats, {0, 1})).teacher_kl.item<double>(), divergence, 1e-12);
  // Gradient of a cross entropy with respect to logits: the difference of the probabilities.
  losses.total.backward();
  EXPECT_LT((logits.grad() - 0.25 * (q - p) / 2).abs().max().item<double>(), 1e-12);
}

TEST(Teacher, WeightDecreasesLinearly) {
  TrainSection train;
  EXPECT_EQ(teacher_weight_at(train, 0), 0);
  train.teacher = "teacher.safetensors";
  train.teacher_coef = 2;
  train.teacher_agent_steps = 100;
  EXPECT_EQ(teacher_weight_at(train, 0), 2);
  EXPECT_EQ(teacher_weight_at(train, 75), 0.5);
  EXPECT_EQ(teacher_weight_at(train, 100), 0);
  EXPECT_EQ(teacher_weight_at(train, 101), 0);
}

class TeacherTest : public ::testing::Test {
 protected:
  // Writes an untrained policy; another seed has other weights.
  std::string policy_of(const std::string& name, std::vector<std::string> settings) const {
    settings.insert(settings.end(), {"run.seed=5", "train.updates=1"});
    train(small_run(folder_ / name, "cpu", settings));
    return folder_ / (name + "/policy.safetensors");
  }
  // Writes a vector policy, scaled so that it is far from uniform.
  std::string vector_policy(const std::string& name, std::vector<std::string> settings = {}) const {
    settings.insert(settings.end(), {"policy.modality=vector", "train.sharpen_agent_steps=8"});
    return policy_of(name, settings);
  }
  // KL divergence of each update's actions from the teacher's.
  std::vector<double> divergences(const std::string& folder) const {
    const auto rows = read_table(folder + "/progress.csv");
    const size_t column =
        static_cast<size_t>(std::find(rows[0].begin(), rows[0].end(), "losses/teacher_kl") - rows[0].begin());
    std::vector<double> all;
    for (size_t i = 1; i < rows.size(); ++i) all.push_back(std::stod(rows[i].at(column)));
    return all;
  }

  const test::ScratchFolder folder_;
};

TEST_F(TeacherTest, AnImagePolicyLearnsTheTeachersActions) {
  const std::string teacher = vector_policy("teacher", {"policy.auxiliary=true", "simulator.wall_observations=true"});
  const std::vector<std::string> settings{"train.teacher=" + teacher, "train.teacher_coef=5", "train.updates=30",
                                          "train.learning_rate=3e-3", "train.warm_up_agent_steps=0"};
  train(small_run(folder_ / "student", "cpu", settings));
  const std::vector<double> with = divergences(folder_ / "student");
  EXPECT_GT(with.front(), 0.05);
  EXPECT_LT(with.back(), 0.5 * with.front());
}

TEST_F(TeacherTest, AnImageTeacherUsesItsOwnImages) {
  // The learner's images are larger and its cameras are randomized; the teacher draws as in its training.
  const std::string teacher = policy_of("teacher", {"train.sharpen_agent_steps=8"});
  for (const std::string modality : {"perspective", "vector"}) {
    std::vector<std::string> settings{
        "train.teacher=" + teacher, "train.teacher_coef=5",        "train.updates=30",
        "train.learning_rate=3e-3", "train.warm_up_agent_steps=0", "policy.modality=" + modality};
    if (modality == "perspective") {
      settings.insert(settings.end(),
                      {"render.width_px=48", "render.height_px=27", "render.randomization.rotation_deg=3"});
    }
    train(small_run(folder_ / modality, "cpu", settings));
    const std::vector<double> with = divergences(folder_ / modality);
    EXPECT_GT(with.front(), 0.05) << modality;
    EXPECT_LT(with.back(), 0.5 * with.front()) << modality;
  }
}

TEST_F(TeacherTest, AZeroWeightChangesNothing) {
  const std::string teacher = vector_policy("teacher");
  const std::vector<std::string> plain{"train.updates=2"},
      none{"train.updates=2", "train.teacher=" + teacher, "train.teacher_coef=0"};
  const std::string hash = train(small_run(folder_ / "plain", "cpu", plain)).policy_hash;
  EXPECT_EQ(train(small_run(folder_ / "none", "cpu", none)).policy_hash, hash);
  EXPECT_THAT(divergences(folder_ / "none"), ::testing::Each(0));
}

TEST_F(TeacherTest, RunsResumeExactly) {
  const std::string alone = train(small_run(folder_ / "alone", "cpu", {"train.updates=2"})).policy_hash;
  for (const std::string& teacher : {vector_policy("vectors"), policy_of("images", {"train.sharpen_agent_steps=8"})}) {
    const auto [whole, again, resumed] = test::policies_of_equal_runs(
        teacher + ".runs", "cpu", {"train.teacher=" + teacher, "train.teacher_agent_steps=300"});
    EXPECT_EQ(again, whole);
    EXPECT_EQ(resumed, whole);
    EXPECT_NE(alone, whole);
  }
}

TEST_F(TeacherTest, RunsWithHeldActionsResumeExactly) {
  const std::string teacher = vector_policy("teacher");
  const std::vector<std::string> held{"train.teacher=" + teacher, "train.teacher_agent_steps=300",
                                      "policy.decision_steps=3"};
  const auto [whole, again, resumed] = test::policies_of_equal_runs(folder_.path(), "cpu", held);
  EXPECT_EQ(again, whole);
  EXPECT_EQ(resumed, whole);
  std::vector<std::string> alone(held);
  alone.insert(alone.end(), {"train.updates=2", "train.teacher_coef=0"});
  EXPECT_NE(train(small_run(folder_ / "alone", "cpu", alone)).policy_hash, whole);
  EXPECT_THAT(divergences(folder_ / "whole"), ::testing::Each(::testing::Gt(0)));
}

TEST_F(TeacherTest, ErrorsNameIncompatibleTeachers) {
  const auto message = [&](const std::string& teacher, std::vector<std::string> settings = {}) {
    settings.push_back("train.teacher=" + teacher);
    return test::message_of([&] { train(small_run(folder_ / "student", "cpu", settings)); });
  };
  const std::string vectors = vector_policy("vectors", {"policy.auxiliary=true"});
  EXPECT_THAT(message(vectors, {"policy.modality=vector"}),
              ::testing::HasSubstr(vectors + ": train.teacher: its policy.auxiliary is true, expected false"));
  EXPECT_THAT(message(folder_ / "absent.safetensors"), ::testing::HasSubstr("absent.safetensors"));
}

}  // namespace
}  // namespace pictura
