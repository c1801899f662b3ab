// A teacher, which is a policy to imitate: its losses, its requirements for a run, and that a policy learns to act and
// to encode scenes like it.
#include "pictura/training/teacher.h"

#include <algorithm>

#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/corridor.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/collector.h"
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

TEST(Teacher, ImitationAloneIgnoresRatios) {
  const auto doubles = at::TensorOptions(at::kDouble);
  const at::Tensor logits = at::tensor({0.3, -1.0, 2.0}, doubles).view({1, 3}).requires_grad_(true);
  Targets targets{at::zeros({1}, at::kLong), at::full({1}, -1e4, doubles), at::zeros({1}, doubles)};
  targets.teacher_log_probs = at::log_softmax(at::tensor({1.0, 0.0, 0.0}, doubles).view({1, 3}), 1);
  targets.teacher_weight = at::ones({}, doubles);
  const Minibatch minibatch{at::zeros({1}, at::kLong), 1, -at::ones({1}, doubles), /*shares=*/{}};
  TrainSection train;
  const auto losses = [&] { return ppo_losses({logits, at::zeros({1}, doubles)}, targets, minibatch, train); };
  EXPECT_TRUE(std::isinf(losses().total.item<double>()));
  train.policy_coef = train.ent_coef = 0;
  EXPECT_TRUE(losses().stats.isfinite().all().item<bool>()) << "otherwise the update would count as failed";
  losses().total.backward();
  const at::Tensor expected = at::softmax(logits, 1) - targets.teacher_log_probs.exp();
  EXPECT_LT((logits.grad() - expected).abs().max().item<double>(), 1e-12);
}

constexpr double kSceneCoef = 0.25;

// Settings of which the scene loss is the only loss if advantages are 0.
TrainSection scene_loss_alone() {
  TrainSection train;
  train.vf_coef = train.ent_coef = 0;
  train.teacher_scene_coef = kSceneCoef;
  return train;
}

// Targets whose other losses are 0.
Targets scene_targets(const at::Tensor& scene) {
  const at::Tensor zeros = at::zeros({scene.size(0)}, at::kFloat);
  return {zeros.to(at::kLong), zeros, zeros, {}, {}, scene};
}

TEST(Teacher, SceneLossIsTheUnexplainedShareOfTheVariance) {
  // Rows 2 and 0 have mean (2, 0), and variance 1 + 4.
  const at::Tensor teacher = at::tensor({1., 2., 100., 100., 3., -2.}, at::kFloat).view({3, 2});
  const at::Tensor rows = at::tensor({2, 0}, at::kLong), errors = at::tensor({0., 2., 1., 0.}, at::kFloat).view({2, 2});
  const at::Tensor scene = (teacher.index_select(0, rows) + errors).requires_grad_(true);
  const at::Tensor scale =
      scene_scale_of(teacher.index_select(0, rows), at::ones({2}, at::kDouble), single_communicator());
  EXPECT_FLOAT_EQ(scale.item<float>(), 0.2f);
  for (const at::Tensor& shares : {at::Tensor(), at::tensor({0.5, 1.5}, at::kFloat)}) {
    const Losses losses = ppo_losses({at::zeros({2, kNumActions}), at::zeros({2}), scene}, scene_targets(teacher),
                                     {rows, 2, at::zeros({2}), shares, scale}, scene_loss_alone());
    const double expected = shares.defined() ? 0.2 * (4 * 0.5 + 1 * 1.5) / 2 : 0.2 * (4 + 1) / 2;
    EXPECT_NEAR(elements_of(at::constant_pad_nd(losses.stats, {0, 1})).scene.item<double>(), expected, 1e-6);
    EXPECT_NEAR(losses.total.item<double>(), kSceneCoef * expected, 1e-6);
    scene.mutable_grad() = at::Tensor();
    losses.total.backward();
    const at::Tensor weights = shares.defined() ? shares : at::ones({2});
    EXPECT_LT((scene.grad() - kSceneCoef * 0.2 * errors * weights.unsqueeze(1)).abs().max().item<double>(), 1e-6);
  }
}

TEST(Teacher, SceneScaleIgnoresRowsWithoutWeight) {
  const at::Tensor embeddings = at::tensor({3., -2., 100., 100., 1., 2.}, at::kFloat).view({3, 2});
  const at::Tensor weights = at::tensor({1., 0., 1.}, at::kDouble);
  EXPECT_FLOAT_EQ(scene_scale_of(embeddings, weights, single_communicator()).item<float>(), 0.2f);
}

TEST(Teacher, EqualEmbeddingsHaveNoSceneLoss) {
  for (const double number : {0.0, 0.1, 1e10}) {
    const at::Tensor equal = at::full({7, 3}, number, at::kFloat);
    const at::Tensor scale = scene_scale_of(equal, at::ones({7}, at::kDouble), single_communicator());
    EXPECT_EQ(scale.item<float>(), 0) << number;
  }
  const at::Tensor none = at::zeros({0, 3}, at::kFloat);
  EXPECT_EQ(scene_scale_of(none, at::zeros({0}, at::kDouble), single_communicator()).item<float>(), 0);
}

TEST(Teacher, SceneLossChangesTheSceneEncoderAlone) {
  const PolicyNetwork policy(test::learning_section(), 1, 7);
  Observation seen = row_of(test::Corridor::storage(), 0).map([](const at::Tensor& t) {
    return t.is_floating_point() ? at::arange(t.numel(), t.options()).sin().view_as(t) : at::ones_like(t);
  });
  const Policy::Output output = policy.forward(seen);
  const int64_t count = output.scene.size(0);
  ASSERT_EQ(output.scene.size(1), policy.scene_width());
  const at::Tensor teacher = at::arange(output.scene.numel(), at::kFloat).cos().view_as(output.scene);
  const at::Tensor scale = scene_scale_of(teacher, at::ones({count}, at::kDouble), single_communicator());
  ppo_losses(output, scene_targets(teacher), {at::arange(count), count, at::zeros({count}), {}, scale},
             scene_loss_alone())
      .total.backward();
  const auto largest = [](const NamedTensor& parameter) {
    const at::Tensor& gradient = parameter.value.grad();
    return gradient.defined() ? gradient.abs().max().item<double>() : 0;
  };
  const std::vector<NamedTensor> trunk = policy.trunk_parameters();
  const size_t num_encoder = policy.parameters().size() - trunk.size();
  ASSERT_EQ(trunk.front().name, "ego.hidden.weight");
  ASSERT_EQ(num_encoder, 16u) << "two layers for each of four sets";
  for (size_t i = 0; i < num_encoder; ++i) EXPECT_GT(largest(policy.parameters()[i]), 1e-6);
  for (const NamedTensor& parameter : trunk) EXPECT_EQ(largest(parameter), 0) << parameter.name;
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
  // A column of each update's progress.
  std::vector<double> progress(const std::string& folder, const std::string& name) const {
    const auto rows = read_table(folder + "/progress.csv");
    const size_t column = static_cast<size_t>(std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin());
    std::vector<double> all;
    for (size_t i = 1; i < rows.size(); ++i) all.push_back(std::stod(rows[i].at(column)));
    return all;
  }
  // KL divergence of each update's actions from the teacher's.
  std::vector<double> divergences(const std::string& folder) const { return progress(folder, "losses/teacher_kl"); }
  // A run of a learner with vectors, like its teacher, that has collected a rollout.
  std::unique_ptr<pictura::Run> collected_run(const std::string& teacher, double coef, double scene_coef) const {
    const TrainOptions options =
        small_run(folder_ / "collected", "cpu",
                  {"policy.modality=vector", "train.teacher=" + teacher, fmt::format("train.teacher_coef={}", coef),
                   fmt::format("train.teacher_scene_coef={}", scene_coef)});
    auto run = std::make_unique<pictura::Run>(load_config(options.config_path, options.overrides), Device{});
    run->simulator->reset();
    run->rollout.teacher_log_probs.fill_(kNotRecorded);
    if (run->rollout.teacher_scene.defined()) run->rollout.teacher_scene.fill_(kNotRecorded);
    EXPECT_TRUE(Collector(run.get()).collect());
    return run;
  }
  static constexpr double kNotRecorded = 1000;

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

TEST_F(TeacherTest, PoliciesLearnTheTeachersSceneEmbeddings) {
  const std::string teacher = vector_policy("teacher");
  // A constant has a loss of 1. These images are too small for much more, but vectors are not.
  for (const auto& [modality, first, last] : {std::tuple{"perspective", 5.0, 1.5}, {"vector", 1.5, 0.5}}) {
    SCOPED_TRACE(modality);
    train(small_run(folder_ / modality, "cpu",
                    {"train.teacher=" + teacher, "train.teacher_coef=0", "train.teacher_scene_coef=1",
                     std::string("policy.modality=") + modality, "train.updates=30", "train.update_epochs=4",
                     "train.adv_filter_threshold=0", "train.learning_rate=5e-3", "train.schedule=linear",
                     "train.schedule_agent_steps=3000", "train.warm_up_agent_steps=0"}));
    const std::vector<double> scene = progress(folder_ / modality, "losses/scene");
    EXPECT_GT(scene.front(), first);
    EXPECT_LT(scene.back(), last);
    EXPECT_THAT(divergences(folder_ / modality), ::testing::Each(0));
  }
}

TEST_F(TeacherTest, RecordsWhatItsWeightsUse) {
  const std::string teacher = vector_policy("teacher");
  for (const auto& [coef, scene_coef] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    SCOPED_TRACE(fmt::format("weights {} and {}", coef, scene_coef));
    const std::unique_ptr<pictura::Run> run = collected_run(teacher, coef, scene_coef);
    const Rollout& rollout = run->rollout;
    const at::Tensor rows = at::nonzero(rollout.decisions().flatten()).squeeze(1);
    ASSERT_GT(rows.size(0), 0);
    EXPECT_EQ(rollout.teacher_log_probs.flatten(0, 1).index_select(0, rows).ne(kNotRecorded).all().item<bool>(),
              coef > 0);
    EXPECT_EQ(rollout.teacher_log_probs.ne(kNotRecorded).any().item<bool>(), coef > 0);
    ASSERT_EQ(rollout.teacher_scene.defined(), scene_coef > 0);
    if (scene_coef == 0) continue;
    const SavedPolicy saved = read_policy(teacher);
    const std::unique_ptr<const Policy> policy = make_policy(saved.config, saved.rig, Device{});
    restore_policy(saved, *policy);
    const at::NoGradGuard no_grad;
    const at::Tensor expected = policy->forward(rollout.observations.gather(rows)).scene,
                     got = rollout.teacher_scene.flatten(0, 1).index_select(0, rows);
    EXPECT_TRUE(got.allclose(expected, 1e-4, 1e-5));
  }
}

TEST_F(TeacherTest, OtherSceneTargetsDiscardGraphs) {
  const std::unique_ptr<pictura::Run> run = collected_run(vector_policy("teacher"), 0, 1);
  // The host supports no graphs. Work that is repeated fails when it is captured, unless graphs were discarded.
  Graphs graphs(Device{}, /*are_used=*/true);
  ChunkRunner runner(*run->policy, run->rollout.observations, nullptr, &graphs);
  const at::Tensor rows = at::nonzero(run->rollout.decisions().flatten()).squeeze(1).narrow(0, 0, 4);
  const Minibatch minibatch{rows, 4, at::zeros({4}), {}, at::ones({})};
  const auto learn = [&](const at::Tensor& scene) {
    Targets targets = scene_targets(run->rollout.teacher_scene.flatten(0, 1));
    targets.teacher_scene = scene;
    runner.set_targets(targets);
    return test::message_of([&] {
      runner.add_gradients(minibatch, 4, [](const Policy::Output& output, const Targets& its, const Minibatch& chunk) {
        return ppo_losses(output, its, chunk, scene_loss_alone());
      });
    });
  };
  const at::Tensor scene = run->rollout.teacher_scene.flatten(0, 1), other = scene.clone();
  EXPECT_EQ(learn({}), test::kNoError);
  EXPECT_EQ(learn(scene), test::kNoError) << "appears";
  EXPECT_EQ(learn(other), test::kNoError) << "moves";
  EXPECT_EQ(learn({}), test::kNoError) << "vanishes";
  EXPECT_EQ(learn(scene), test::kNoError);
  EXPECT_THAT(learn(scene), ::testing::HasSubstr("train.graphs"));
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
                                      "train.teacher_scene_coef=0.5", "policy.decision_steps=3"};
  const auto [whole, again, resumed] = test::policies_of_equal_runs(folder_.path(), "cpu", held);
  EXPECT_EQ(again, whole);
  EXPECT_EQ(resumed, whole);
  std::vector<std::string> alone(held);
  alone.insert(alone.end(), {"train.updates=2", "train.teacher_coef=0", "train.teacher_scene_coef=0"});
  EXPECT_NE(train(small_run(folder_ / "alone", "cpu", alone)).policy_hash, whole);
  EXPECT_THAT(divergences(folder_ / "whole"), ::testing::Each(::testing::Gt(0)));
  EXPECT_THAT(progress(folder_ / "whole", "losses/scene"), ::testing::Each(::testing::Gt(0)));
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
  const std::string narrow = vector_policy("narrow", {"policy.embedding_width=16"});
  EXPECT_THAT(message(narrow, {"train.teacher_scene_coef=1", "policy.embedding_width=32"}),
              ::testing::AllOf(::testing::HasSubstr(narrow + ": train.teacher_scene_coef: "),
                               ::testing::HasSubstr("have 64 numbers"), ::testing::HasSubstr("expected 128")));
  EXPECT_EQ(message(narrow, {"policy.embedding_width=32", "train.updates=1"}), test::kNoError);
}

}  // namespace
}  // namespace pictura
