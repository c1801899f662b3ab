// Small evaluations that a run makes of itself.
#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>

#include "pictura/common/support/file.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/checkpoint.h"

namespace pictura {
namespace {

using test::read_table;
using ::testing::ElementsAre;
using Table = std::vector<std::vector<std::string>>;

// The cells below a name.
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

  test::ScratchFolder folder_;
};

TEST_F(RunWithEvaluations, LearnsTheSameAndMeasuresWhatEvaluateMeasures) {
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
  EvaluateOptions o = test::one_scenario(with.checkpoint, 10);
  o.scenarios = 2;
  o.agents_per_world = 3;
  const EvaluateRow row = evaluate(o).rows.at(0);
  EXPECT_GT(row.km_driven, 0);
  EXPECT_EQ(column(table, "evaluation/km_driven")[1], fmt::format("{:.9g}", row.km_driven));
  for (const auto& [name, estimate] : metrics_of(row)) {
    EXPECT_EQ(column(table, "evaluation/" + name)[1], fmt::format("{:.9g}", estimate.value)) << name;
    EXPECT_EQ(column(table, "evaluation/" + name + "_half_width_95")[1], fmt::format("{:.9g}", estimate.half_width_95));
  }
}

TEST_F(RunWithEvaluations, GoesOnWithTornAndMissingRows) {
  const TrainReport whole = train(evaluating("whole", 1));
  train(evaluating("parts", 1, 2));
  // Killed after the checkpoint and before the evaluation that follows; a row of an update that is not done, and a torn
  // one.
  const std::string path = evaluations("parts"), text = read_file(path);
  const size_t last_row = text.rfind('\n', text.size() - 2) + 1;
  write_file(path, text.substr(0, last_row) + "3" + text.substr(last_row + 1) + text.substr(last_row, 7));
  TrainOptions rest = evaluating("parts", 1);
  rest.old_run = OldRun::resume;
  EXPECT_EQ(train(rest).policy_hash, whole.policy_hash);
  const Table parts = read_table(path), all = read_table(evaluations("whole"));
  ASSERT_THAT(column(parts, "update"), ElementsAre("1", "2", "3", "4"));
  for (const std::string& name : all[0]) {
    if (name != "time/evaluation_s") EXPECT_EQ(column(parts, name), column(all, name)) << name;
  }
}

TEST_F(RunWithEvaluations, IsOutOfTimeBeforeAnEvaluationThatWouldNotEndAndMakesItLater) {
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

}  // namespace
}  // namespace pictura
