// Parts of a training run other than learning: small evaluations, and changes of the image size.
#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/checkpoint.h"

namespace pictura {
namespace {

using test::message_of;
using test::read_table;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Table = std::vector<std::vector<std::string>>;

// Returns the cells below a column's name.
std::vector<std::string> column(const Table& table, const std::string& name) {
  const auto at = static_cast<size_t>(std::find(table[0].begin(), table[0].end(), name) - table[0].begin());
  std::vector<std::string> cells;
  for (size_t row = 1; row < table.size(); ++row) cells.push_back(table[row].at(at));
  return cells;
}

class RunWithEvaluations : public ::testing::Test {
 protected:
  TrainOptions options(const std::string& run, const std::vector<std::string>& more) const {
    return test::small_run(folder_ / run, "cpu", more);
  }
  TrainOptions evaluating(const std::string& run, int every, int updates = 4) const {
    return options(
        run, {fmt::format("train.evaluate_every={}", every), "train.evaluate_scenarios=2", "train.evaluate_agents=3",
              "train.evaluate_steps=10", fmt::format("train.updates={}", updates)});
  }
  std::string evaluations(const std::string& run) const { return folder_ / (run + "/evaluation.csv"); }

  /// Checks that the last evaluation of a run equals that of evaluate() with its last checkpoint.
  void expect_last_row_as_evaluate_measures(const std::string& run, const std::string& checkpoint) const {
    const Table table = read_table(evaluations(run));
    EvaluateOptions o = test::one_scenario(checkpoint, 10);
    o.scenarios = 2;
    o.agents_per_world = 3;
    const EvaluateRow row = evaluate(o).rows.at(0);
    EXPECT_EQ(column(table, "evaluation/km_driven").back(), fmt::format("{:.9g}", row.km_driven));
    for (const auto& [name, estimate] : metrics_of(row)) {
      EXPECT_EQ(column(table, "evaluation/" + name).back(), fmt::format("{:.9g}", estimate.value)) << name;
      EXPECT_EQ(column(table, "evaluation/" + name + "_half_width_95").back(),
                fmt::format("{:.9g}", estimate.half_width_95));
    }
  }

  test::ScratchFolder folder_;
};

TEST_F(RunWithEvaluations, LearnsIdenticallyAndMatchesTheEvaluateCommand) {
  const TrainReport without = train(options("without", {})), with = train(evaluating("with", 2));
  EXPECT_EQ(with.policy_hash, without.policy_hash);
  EXPECT_EQ(with.agent_steps, without.agent_steps);
  EXPECT_EQ(read_checkpoint(with.checkpoint).simulator, read_checkpoint(without.checkpoint).simulator);
  EXPECT_GT(with.evaluation_s, 0);
  EXPECT_EQ(without.evaluation_s, 0);
  EXPECT_FALSE(std::filesystem::exists(evaluations("without")));

  const Table table = read_table(evaluations("with")), progress = read_table(folder_ / "with/progress.csv");
  ASSERT_THAT(column(table, "update"), ElementsAre("2", "4"));
  const std::vector<std::string> agent_steps = column(progress, "charts/agent_steps");
  EXPECT_THAT(column(table, "charts/agent_steps"), ElementsAre(agent_steps[1], agent_steps[3]));
  EXPECT_NE(column(table, "evaluation/km_driven")[1], "0");
  expect_last_row_as_evaluate_measures("with", with.checkpoint);
}

TEST_F(RunWithEvaluations, EvaluatesOnlyOriginalMapsNotCopies) {
  TrainOptions plain = evaluating("plain", 4), copied = evaluating("copied", 4);
  for (TrainOptions* one : {&plain, &copied}) {
    one->overrides.insert(one->overrides.end(), {"simulator.min_agents=4", "simulator.max_agents=4", "run.seed=2"});
  }
  copied.overrides.emplace_back("simulator.map_copies=1");
  const TrainReport with = train(copied);
  EXPECT_NE(with.policy_hash, train(plain).policy_hash);
  expect_last_row_as_evaluate_measures("copied", with.checkpoint);

  TrainOptions parts = copied;
  parts.out_folder = folder_ / "parts";
  parts.overrides.emplace_back("train.updates=2");
  train(parts);
  parts.overrides.back() = "train.updates=4";
  parts.old_run = OldRun::resume;
  EXPECT_EQ(train(parts).policy_hash, with.policy_hash);
}

TEST_F(RunWithEvaluations, EvaluatesWithoutCameraRandomization) {
  TrainOptions shaken = evaluating("shaken", 2, 2), plain = evaluating("plain", 2, 2);
  shaken.overrides.insert(shaken.overrides.end(),
                          {"render.randomization.rotation_deg=6", "render.randomization.noise_share=0.2"});
  const TrainReport report = train(shaken);
  EXPECT_NE(report.policy_hash, train(plain).policy_hash);
  expect_last_row_as_evaluate_measures("shaken", report.checkpoint);
}

TEST_F(RunWithEvaluations, ResumesWithTornAndMissingRows) {
  const TrainReport whole = train(evaluating("whole", 1));
  train(evaluating("parts", 1, 2));
  // The run was killed after the checkpoint and before the following evaluation; the file has a row of an update that
  // is not done, and a torn row.
  const std::string path = evaluations("parts"), text = read_file(path);
  const size_t last_row = text.rfind('\n', text.size() - 2) + 1;
  write_file(path, text.substr(0, last_row) + "3" + text.substr(last_row + 1) + text.substr(last_row, 7));
  TrainOptions rest = evaluating("parts", 1);
  rest.old_run = OldRun::resume;
  EXPECT_EQ(train(rest).policy_hash, whole.policy_hash);
  const Table parts = read_table(path), all = read_table(evaluations("whole"));
  ASSERT_THAT(column(parts, "update"), ElementsAre("1", "2", "3", "4"));
  for (const std::string& name : all[0]) {
    if (name == "time/evaluation_s") continue;
    EXPECT_EQ(column(parts, name), column(all, name)) << name;
  }
}

TEST_F(RunWithEvaluations, DefersAnEvaluationBeyondTheTimeLimit) {
  const TrainReport first = train(evaluating("run", 2, 1));
  Checkpoint saved = read_checkpoint(first.checkpoint);
  saved.longest_update_s["host, 8 agents, evaluation"] = 3600;
  write_checkpoint(first.checkpoint, saved);
  TrainOptions rest = evaluating("run", 2);
  rest.old_run = OldRun::resume;
  rest.minutes = 60;
  const TrainReport stopped = train(rest);
  EXPECT_TRUE(stopped.out_of_time);
  EXPECT_EQ(stopped.updates, 2);
  EXPECT_EQ(read_table(evaluations("run")).size(), 1u);
  rest.minutes = 0;
  EXPECT_EQ(train(rest).updates, 4);
  EXPECT_THAT(column(read_table(evaluations("run")), "update"), ElementsAre("2", "4"));
}

class RunWithImageSizes : public RunWithEvaluations {
 protected:
  TrainOptions scheduled(const std::string& run, const std::string& schedule, int updates) {
    TrainOptions o = evaluating(run, 1, updates);
    o.overrides.push_back("render.schedule=" + schedule);
    o.on_notice = [this](const std::string& notice) { notices_.push_back(notice); };
    return o;
  }
  std::vector<std::string> notices_;
};

TEST_F(RunWithImageSizes, ChangesSizesBetweenUpdatesAndResumesExactly) {
  const TrainReport whole = train(scheduled("whole", "[[100, 20, 12], [100000, 40, 20]]", 4));
  const Table progress = read_table(folder_ / "whole/progress.csv"), evaluated = read_table(evaluations("whole"));
  const std::vector<std::string> agent_steps = column(progress, "charts/agent_steps"),
                                 width_px = column(progress, "charts/image_width_px"),
                                 evaluated_px = column(evaluated, "evaluation/image_width_px");
  ASSERT_EQ(width_px.size(), 4u);
  ASSERT_EQ(evaluated_px.size(), 4u);
  int64_t changed_after = 0;
  for (size_t row = 0; row < 4; ++row) {
    const bool is_past = std::stoll(agent_steps[row]) >= 100;
    EXPECT_EQ(width_px[row], row > 0 && std::stoll(agent_steps[row - 1]) >= 100 ? "20" : "16");
    EXPECT_EQ(evaluated_px[row], is_past ? "20" : "16");
    if (is_past && changed_after == 0) changed_after = static_cast<int64_t>(row) + 1;
  }
  ASSERT_GT(changed_after, 1);
  ASSERT_LT(changed_after, 4);
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_EQ(notices_[0], fmt::format("from {} agent-steps on images are 20x12 instead of 16x9",
                                     agent_steps[static_cast<size_t>(changed_after) - 1]));
  EXPECT_EQ(first_difference(read_checkpoint(whole.checkpoint).rig, paper_rig(20, 12)), "");

  // Saved before the change, right after it, and with the new size.
  for (const int64_t updates : {changed_after - 1, changed_after, changed_after + 1}) {
    const std::string run = fmt::format("parts {}", updates);
    train(scheduled(run, "[[100, 20, 12], [100000, 40, 20]]", static_cast<int>(updates)));
    TrainOptions rest = scheduled(run, "[[100, 20, 12], [100000, 40, 20]]", 4);
    rest.old_run = OldRun::resume;
    EXPECT_EQ(train(rest).policy_hash, whole.policy_hash) << updates;
    EXPECT_EQ(column(read_table(folder_ / (run + "/progress.csv")), "charts/image_width_px"), width_px);
  }
  EXPECT_NE(train(options("small", {})).policy_hash, whole.policy_hash);
}

TEST_F(RunWithImageSizes, SpreadsTheFirstConvolutionAndResumesExactly) {
  const std::string schedule = "[[100, 32, 18, 2, 0.7]]";
  const TrainReport whole = train(scheduled("whole", schedule, 4));
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_THAT(notices_[0], HasSubstr("images are 32x18 in patches of 2 px, lines of 0.7 px or more, instead of 16x9 in "
                                     "patches of 1 px"));
  const Checkpoint saved = read_checkpoint(whole.checkpoint);
  const SavedPolicy weights = read_policy(folder_ / "whole/policy.safetensors");
  for (const SavedPolicy& policy : {static_cast<const SavedPolicy&>(saved), weights}) {
    EXPECT_EQ(policy.config.policy.patch_px, 2);
    EXPECT_EQ(policy.config.render.line_floor_px, 0.7);
    EXPECT_EQ(policy.config.render.width_px, 32);
    EXPECT_EQ(first_difference(policy.rig, paper_rig(32, 18)), "");
    EXPECT_EQ(policy.rate_factors, (std::map<std::string, double>{{"conv.0.weight", 0.25}}));
    EXPECT_EQ(hash_of_parameters(policy.parameters), whole.policy_hash);
  }
  const Table progress = read_table(folder_ / "whole/progress.csv");
  const std::vector<std::string> width_px = column(progress, "charts/image_width_px");
  const auto changed_after = std::count(width_px.begin(), width_px.end(), "16");
  ASSERT_GT(changed_after, 1);
  ASSERT_LT(changed_after, 4);
  for (const int64_t updates : {changed_after - 1, changed_after, changed_after + 1}) {
    const std::string run = fmt::format("parts {}", updates);
    train(scheduled(run, schedule, static_cast<int>(updates)));
    TrainOptions rest = scheduled(run, schedule, 4);
    rest.old_run = OldRun::resume;
    EXPECT_EQ(train(rest).policy_hash, whole.policy_hash) << updates;
  }
  // A checkpoint from before the change resumes with the schedule's later sizes, and with nothing else.
  train(scheduled("late", "[]", 2));
  TrainOptions rest = scheduled("late", schedule, 4);
  rest.old_run = OldRun::resume;
  EXPECT_THAT(message_of([&] { train(rest); }),
              AllOf(HasSubstr("checkpoint.ckpt"), HasSubstr("render.line_floor_px: 0.35 became 0.7")));
  // Another run that starts from the weights keeps the learning rate of weights that move together.
  TrainOptions next = options("next", {"train.updates=1", "render.width_px=32", "render.height_px=18",
                                       "policy.patch_px=2", "render.line_floor_px=0.7"});
  next.init_from = whole.checkpoint;
  EXPECT_EQ(read_checkpoint(train(next).checkpoint).rate_factors, saved.rate_factors);
}

TEST_F(RunWithImageSizes, AllowsFutureScheduleChangesButNotPastOnesOnResume) {
  train(scheduled("run", "[]", 2));
  TrainOptions rest = scheduled("run", "[[100, 20, 12]]", 4);
  rest.old_run = OldRun::resume;
  EXPECT_THAT(message_of([&] { train(rest); }), AllOf(HasSubstr("checkpoint.ckpt"), HasSubstr("size_px")));
  notices_.clear();
  rest.overrides.back() = "render.schedule=[[200, 20, 12]]";
  train(rest);
  ASSERT_EQ(notices_.size(), 2u);
  EXPECT_EQ(notices_[0], "render.schedule: [] became [[200, 20, 12]]");
  EXPECT_THAT(notices_[1], HasSubstr("images are 20x12 instead of 16x9"));
}

TEST_F(RunWithImageSizes, StartsWithWeightsOfOtherCamerasOfEqualNumber) {
  const std::string first = train(options("first", {"train.updates=1"})).checkpoint;
  std::string config;
  std::istringstream lines(read_file(PICTURA_SOURCE_DIR "/configs/smoke.toml"));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("width_px") && !line.starts_with("height_px")) config += line + '\n';
    if (line == "[render]") config += "rig = \"rig.toml\"\n";
  }
  write_file(folder_ / "config.toml", config);
  const auto with_cameras = [&](int cameras) {
    std::string rig;
    for (int i = 0; i < cameras; ++i) {
      rig +=
          fmt::format("[[camera]]\nname = \"c{}\"\nwidth_px = {}\nheight_px = 9\nfocal_px = 8\nx_m = 1\n", i, 16 + i);
    }
    write_file(folder_ / "rig.toml", rig);
    TrainOptions o = options(fmt::format("with {}", cameras), {"train.updates=1"});
    o.config_path = folder_ / "config.toml";
    std::erase_if(o.overrides, [](const std::string& text) {
      return text.starts_with("render.width_px") || text.starts_with("render.height_px");
    });
    o.init_from = first;
    return o;
  };
  EXPECT_EQ(train(with_cameras(4)).updates, 1);
  const std::vector<NamedTensor> begun = read_checkpoint(folder_ / "with 4/untrained.ckpt").parameters,
                                 other = read_checkpoint(first).parameters;
  for (size_t i = 0; i < other.size(); ++i) EXPECT_TRUE(begun.at(i).value.equal(other[i].value)) << other[i].name;
  EXPECT_THAT(message_of([&] { train(with_cameras(3)); }),
              AllOf(HasSubstr(first), HasSubstr("uses 4 cameras"), HasSubstr("expected 3"), HasSubstr("rig.toml")));
}

}  // namespace
}  // namespace pictura
