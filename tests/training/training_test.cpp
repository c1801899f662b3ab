// Training end to end on a few vehicles of the procedural town: files, exact resume, ^C's boundary, evaluation.
#include "pictura/training/training.h"

#include <cmath>
#include <csignal>
#include <filesystem>
#include <sstream>

#include <gmock/gmock.h>

#include "pictura/common/error.h"
#include "pictura/common/file.h"
#include "pictura/common/interrupt.h"
#include "pictura/training/config.h"

namespace pictura {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Training : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        ::testing::TempDir() + "/pictura_training_" + ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  TrainOptions options(const std::string& run, const std::vector<std::string>& more = {}) const {
    TrainOptions o;
    o.config_path = PICTURA_SOURCE_DIR "/configs/smoke.toml";
    o.out_folder = folder_ + "/" + run;
    o.overrides = {
        "run.num_threads=1",         "run.backend=cpu",    "render.width_px=16",          "render.height_px=9",
        "simulator.num_slots=8",     "train.num_steps=12", "policy.conv_channels=[4, 8]", "policy.conv_kernels=[3, 3]",
        "policy.conv_strides=[2, 2]"};
    o.overrides.insert(o.overrides.end(), more.begin(), more.end());
    return o;
  }
  std::string folder_;
};

TEST_F(Training, ResumesExactly) {
  const TrainReport whole = train(options("whole"));
  EXPECT_EQ(whole.updates, 4);
  EXPECT_GT(whole.agent_steps, 0);

  const TrainReport half = train(options("parts", {"train.updates=2"}));
  EXPECT_NE(half.policy_hash, whole.policy_hash);
  TrainOptions rest = options("parts");
  rest.resume = true;
  const TrainReport resumed = train(rest);
  EXPECT_EQ(resumed.policy_hash, whole.policy_hash);
  EXPECT_EQ(resumed.agent_steps, whole.agent_steps);
  EXPECT_EQ(resumed.km_driven, whole.km_driven);

  // One row per update, once each, after the head.
  std::istringstream csv(read_file(folder_ + "/parts/progress.csv"));
  std::vector<std::string> first_cells;
  for (std::string line; std::getline(csv, line);) first_cells.push_back(line.substr(0, line.find(',')));
  EXPECT_THAT(first_cells, ::testing::ElementsAre("update", "1", "2", "3", "4"));
}

TEST_F(Training, WritesWhatItPromisesAndStartsFromItsSeed) {
  const TrainReport report = train(options("run", {"train.updates=1"}));
  for (const char* name : {"config.toml", "untrained.ckpt", "checkpoint.ckpt", "policy.safetensors", "progress.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ + "/run/" + name)) << name;
  }
  EXPECT_EQ(report.checkpoint, folder_ + "/run/checkpoint.ckpt");
  const Config resolved = load_config(folder_ + "/run/config.toml");
  EXPECT_EQ(resolved.train.updates, 1);
  EXPECT_EQ(resolved.render.width_px, 16);
  const TrainReport again = train(options("again", {"train.updates=1"}));
  EXPECT_EQ(again.policy_hash, report.policy_hash);
  const TrainReport other = train(options("other", {"train.updates=1", "run.seed=2"}));
  EXPECT_NE(other.policy_hash, report.policy_hash);
}

TEST_F(Training, InterruptedRunSavesAndGoesOnExactly) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  TrainOptions stopped = options("stopped");
  stopped.on_progress = [](const TrainProgress& progress) {
    if (progress.update == 2) std::raise(SIGINT);
  };
  // In a process of its own, since the flag that ^C sets is never taken back.
  EXPECT_EXIT(
      {
        catch_interrupts();
        const TrainReport report = train(stopped);
        std::exit(report.interrupted && report.updates == 2 ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
  TrainOptions rest = options("stopped");
  rest.resume = true;
  EXPECT_EQ(train(rest).policy_hash, train(options("whole")).policy_hash);
}

TEST_F(Training, RefusesToResumeUnderAnotherConfigurationByName) {
  train(options("run", {"train.updates=1"}));
  TrainOptions changed = options("run", {"policy.backbone_width=64"});
  changed.resume = true;
  try {
    train(changed);
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("checkpoint.ckpt"), HasSubstr("policy.backbone_width: 128 became 64")));
  }
  TrainOptions nothing = options("nowhere");
  nothing.resume = true;
  EXPECT_THROW(train(nothing), Error);
}

TEST_F(Training, VectorPolicyTrainsAndIsEvaluated) {
  const TrainReport report = train(options("run", {"train.updates=1", "policy.modality=vector"}));
  EvaluateOptions o;
  o.checkpoint = report.checkpoint;
  o.maps = {"procedural"};
  o.agents_per_world = 6;
  o.scenarios = 3;
  o.steps = 25;
  o.num_threads = 1;
  o.backend = "cpu";
  double done = 0;
  o.on_progress = [&](double fraction, double) { done = fraction; };
  const std::vector<EvaluateRow> rows = evaluate(o);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].scenarios, 3);
  EXPECT_LE(rows[0].vehicle_episodes, 18);
  EXPECT_GT(rows[0].vehicle_episodes, 0);
  EXPECT_EQ(done, 1);
  for (const double rate : {rows[0].at_fault_collision_rate, rows[0].off_road_rate, rows[0].red_light_rate}) {
    EXPECT_GE(rate, 0);
    EXPECT_LE(rate, 1);
  }
  // The same again, and drawn actions are something else.
  const std::vector<EvaluateRow> again = evaluate(o);
  EXPECT_EQ(again[0].km_driven, rows[0].km_driven);
  o.argmax = false;
  EXPECT_NE(evaluate(o)[0].km_driven, rows[0].km_driven);
  o.scenarios = 0;
  EXPECT_THROW(evaluate(o), UsageError);
}

TEST_F(Training, PerspectivePolicyIsEvaluatedFromItsImages) {
  const TrainReport report = train(options("run", {"train.updates=1"}));
  EvaluateOptions o;
  o.checkpoint = report.checkpoint;
  o.maps = {"procedural"};
  o.densities = {Density::light};
  o.scenarios = 1;
  o.steps = 3;
  o.num_threads = 1;
  o.backend = "cpu";
  const std::vector<EvaluateRow> rows = evaluate(o);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].density, "light");
  EXPECT_GT(rows[0].vehicle_episodes, 0);
  EXPECT_LE(rows[0].vehicle_episodes, 60);
  EXPECT_GT(rows[0].km_driven, 0);
}

}  // namespace
}  // namespace pictura
