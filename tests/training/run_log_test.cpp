// progress.csv: the rows kept from an existing file, logged values, notices, the progress line, and the effect of a
// full disk on a run's files.
#include "pictura/training/run_log.h"

#include <algorithm>
#include <clocale>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "pictura/cli/train_progress.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ProgressCsvFile : public ::testing::Test {
 protected:
  // Returns the file after a run with `updates_done` completed updates has found `before` in it and written update 9.
  std::string after(const std::string& before, int64_t updates_done) {
    write_file(path_, before);
    ProgressCsv csv(path_, columns_, updates_done, [this](const std::string& text) { notices_.push_back(text); });
    csv.write(9, {{"a", 0.5}, {"b", 7}});
    return read_file(path_);
  }

  test::ScratchFolder folder_;
  const std::string path_ = folder_ / "progress.csv";
  const Scalars columns_{{"a", 0}, {"b", 0}};
  std::vector<std::string> notices_;
};

TEST_F(ProgressCsvFile, KeepsCompleteRowsOfFinishedUpdates) {
  const std::string rows = "update,a,b\n1,2,3\n2,nan,-5e-3\n";
  const std::string whole = rows + "9,0.5,7\n";
  EXPECT_EQ(after("", 2), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(after(rows, 2), whole);
  EXPECT_EQ(after(rows + "3,1,1\n4,1,1\n", 2), whole) << "beyond the checkpoint";
  EXPECT_EQ(after(rows + "2,4", 2), whole) << "torn";
  EXPECT_EQ(after(rows + "2,4,5", 2), whole) << "torn, though of all columns: who knows of how many digits";
  EXPECT_EQ(after("update,a,b\n1,2,3\n2,42,nan,-5e-3\n2,nan,-5e-3\n", 2), whole) << "torn, and appended to since";
  EXPECT_EQ(after("update,a,b\n1,2,3\n2,4\n2,,4\n2,x,4\n2,nan,-5e-3\n", 2), whole);
  EXPECT_EQ(after(rows + std::string(300, '\0'), 2), whole) << "never written";
  EXPECT_EQ(after("update,a", 2), "update,a,b\n9,0.5,7\n");
  EXPECT_TRUE(notices_.empty());
  EXPECT_EQ(folder_.num_entries(), 1u);
}

TEST_F(ProgressCsvFile, KeepsItsRowsUnderALocaleOfDecimalCommas) {
  const test::ScratchFolder locales;  // few machines have such a locale installed
  const std::string make = "localedef -i de_DE -f UTF-8 " + locales.path() + "/de_DE.UTF-8 2>/dev/null";
  if (std::system(make.c_str()) != 0) GTEST_SKIP() << "localedef makes no locale here";
  const test::EnvironmentVariable place("LOCPATH", locales.path());
  ASSERT_TRUE(std::setlocale(LC_ALL, "de_DE.UTF-8"));
  const std::string rows = "update,a,b\n1,2.5,3e-2\n2,0.25,-5e-3\n", written = after(rows, 2);
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(written, rows + "9,0.5,7\n");
}

TEST_F(ProgressCsvFile, DifferentColumnsStartANewFile) {
  const std::string old = "update,a\n1,2\n", older = "update,z,b\n1,2,3\n";
  EXPECT_EQ(after(old, 1), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(read_file(path_ + ".1"), old);
  EXPECT_THAT(notices_, ::testing::ElementsAre(AllOf(HasSubstr(path_ + ":"), HasSubstr(path_ + ".1"))));
  EXPECT_EQ(after(older, 1), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(read_file(path_ + ".1"), old);
  EXPECT_EQ(read_file(path_ + ".2"), older);
}

class LoggedRun : public ::testing::Test {
 protected:
  test::ScratchFolder folder_;
};

// Returns the number below a name in the last row of a run's progress.csv.
double logged(const std::string& folder, const std::string& name) {
  const std::vector<std::vector<std::string>> table = test::read_table(folder + "/progress.csv");
  const auto column = std::find(table[0].begin(), table[0].end(), name) - table[0].begin();
  EXPECT_LT(static_cast<size_t>(column), table[0].size()) << name;
  return std::stod(table.back().at(static_cast<size_t>(column)));
}

TEST_F(LoggedRun, LogsReturnsByTermAndTimesOfFirstMoves) {
  // Episodes as long as the rollout, so that all end in it.
  const TrainReport report =
      train(test::small_run(folder_ / "run", "cpu", {"train.updates=1", "simulator.episode_steps=12"}));
  const std::string run = folder_ / "run";
  double sum = 0;
#define X(name) sum += logged(run, "rewards/" #name "_per_1000_steps");
  PICTURA_REWARD_TERMS(X)
#undef X
  EXPECT_NEAR(sum, 1000 * logged(run, "charts/reward_per_step"), 1e-3);
  EXPECT_NE(sum, 0);
  EXPECT_GE(logged(run, "rewards/goal_per_1000_steps"), 0);
  EXPECT_LT(logged(run, "rewards/timestep_per_1000_steps"), 0);
  // Jerks of 4 m/s^3 make 0.3 m/s in 0.4 s at the earliest, and 12 steps are 1.2 s.
  EXPECT_GT(logged(run, "agents/first_motion_s"), 0.15);
  EXPECT_LT(logged(run, "agents/first_motion_s"), 1.21);
  EXPECT_LT(logged(run, "agents/never_moved_share"), 1);
  EXPECT_GE(logged(run, "agents/never_moved_share"), 0);
  EXPECT_GE(logged(run, "agents/first_waypoint_share"), 0);
  EXPECT_LT(logged(run, "agents/first_waypoint_share"), 1);
  EXPECT_EQ(report.updates, 1);
  const WeightRms weights = weight_rms(read_policy(report.checkpoint).parameters);
  EXPECT_GT(weights.all, 0);
  EXPECT_NEAR(logged(run, "charts/weight_rms"), weights.all, 1e-6 * weights.all);
  EXPECT_NEAR(logged(run, "charts/weight_rms_largest"), weights.largest, 1e-6 * weights.largest);
}

TEST_F(LoggedRun, TheProgressLineShowsRateTimeLeftMetricsAndPhases) {
  std::vector<TrainProgress> seen;
  TrainOptions o = test::small_run(folder_ / "run", "cpu", {"train.updates=2"});
  o.on_progress = [&seen](const TrainProgress& progress) { seen.push_back(progress); };
  o.minutes = 1e6;
  train(o);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_FALSE(seen[0].ends_by_minutes);
  EXPECT_THAT(progress_text(seen[0]),
              ::testing::MatchesRegex("update 1/2  ETA [0-9]+ s  [0-9]+ agent-steps  [0-9.]+[ K]*/s  return [-0-9.]+  "
                                      "[0-9.]+ m/s  [0-9.]+ goals/km  [-0-9.]+ km/infraction"));
  EXPECT_THAT(phase_shares(seen[0]),
              ::testing::MatchesRegex("simulate [0-9]+ %, render [0-9]+ %, forward [0-9]+ %, learn [0-9]+ %, diagnose "
                                      "[0-9]+ %, backward [0-9]+ %, optimize [0-9]+ %, other [0-9]+ %"));
  const std::string last = progress_text(seen[1]);
  EXPECT_THAT(last, HasSubstr("update 2/2  ETA 0 s  "));
  double infractions_per_km = 0;
  for (const char* event : {"at_fault_collisions", "off_road", "red_light"}) {
    infractions_per_km += logged(folder_ / "run", fmt::format("driving/{}_per_km", event));
  }
  const std::string km = infractions_per_km > 0 ? fmt::format("{:.2f}", 1 / infractions_per_km) : "-";
  EXPECT_THAT(last, HasSubstr("  " + km + " km/infraction"));
  EXPECT_LT(last.size(), 120u);
  EXPECT_THAT(last, HasSubstr(fmt::format("{:.1f} m/s", logged(folder_ / "run", "driving/mean_speed_mps"))));

  // The minutes end the run before a hundred million updates, and before the schedule's end.
  o = test::small_run(folder_ / "other", "cpu", {"train.updates=100000000", "train.schedule_agent_steps=1000000000"});
  o.on_progress = [&seen](const TrainProgress& progress) { seen.push_back(progress); };
  o.minutes = 0.05;
  EXPECT_TRUE(train(o).out_of_time);
  ASSERT_GT(seen.size(), 2u);
  EXPECT_TRUE(seen[2].ends_by_minutes);
  EXPECT_LT(seen[2].eta_s, 3);
  EXPECT_THAT(progress_text(seen[2]), HasSubstr("ETA at most "));
}

TEST_F(ProgressCsvFile, ReportsTheFirstUpdateWithDifferingLogProbabilities) {
  RunLog log(folder_.path(), Config{}, 0, 0, {}, [this](const std::string& text) { notices_.push_back(text); });
  UpdateRecord record;
  for (const bool is_rejected : {false, true, true, false}) {
    record.stats.rejected.reset();
    if (is_rejected) record.stats.rejected = LossStats{.clip_fraction = 0.25, .abs_log_ratio = 0.0625};
    log.add(5, 1, record);
  }
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_THAT(notices_[0], AllOf(HasSubstr("update 5: "), HasSubstr("0.062"), HasSubstr("0.25 of the ratios"),
                                 HasSubstr("losses/recomputed")));
  std::vector<std::string> column;
  const auto rows = test::read_table(folder_ / "progress.csv");
  const auto at = static_cast<size_t>(std::find(rows[0].begin(), rows[0].end(), "losses/recomputed") - rows[0].begin());
  for (const auto& row : rows) column.push_back(row.at(at));
  EXPECT_THAT(column, ::testing::ElementsAre("losses/recomputed", "0", "1", "1", "0"));
}

// Scope in which no file can grow beyond a size, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : old_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

using FullDisks = ProgressCsvFile;

TEST_F(FullDisks, ErrorsOfCsvAndEventsNameFileAndReason) {
  const auto fill = [](const auto& write) {
    const FullDisk full(2000);
    return message_of([&] {
      for (int64_t i = 0; i < 1000; ++i) write(i);
    });
  };
  ProgressCsv csv(path_, columns_, 0, {});
  EXPECT_EQ(fill([&](int64_t i) { csv.write(i, columns_); }), path_ + ": writing failed: File too large");
  EventFile events(folder_.path());
  EXPECT_THAT(fill([&](int64_t i) { events.write(i, columns_); }),
              AllOf(HasSubstr(folder_ / "events.out.tfevents."), HasSubstr(": writing failed: File too large")));
  // The torn row is removed when the run resumes.
  ProgressCsv again(path_, columns_, 2000, {});
  const std::string rows = read_file(path_);
  EXPECT_EQ(rows.back(), '\n');
  EXPECT_GT(rows.size(), 1900u);
}

TEST_F(FullDisks, KeepTheOldFileWhole) {
  const std::string old = "update,a,b\n1,2,3\n" + std::string(3000, '9');
  write_file(path_, old);
  {
    const FullDisk full(5);
    EXPECT_THAT(message_of([&] { ProgressCsv(path_, columns_, 1, {}); }),
                AllOf(HasSubstr(path_), HasSubstr("File too large")));
  }
  EXPECT_EQ(read_file(path_), old);
  EXPECT_EQ(folder_.num_entries(), 1u);
}

TEST_F(FullDisks, KeepTheLastCheckpointOfARun) {
  TrainOptions run{.config_path = PICTURA_SOURCE_DIR "/configs/smoke.toml", .out_folder = folder_ / "run"};
  run.overrides = {"run.device=cpu",           "run.num_threads=1",  "policy.modality=vector",
                   "simulator.num_slots=8",    "train.num_steps=12", "train.checkpoint_every=2",
                   "policy.backbone_width=64", "train.updates=2"};
  const TrainReport first = train(run);
  const std::string checkpoint = read_file(first.checkpoint);
  run.old_run = OldRun::resume;
  run.overrides.back() = "train.updates=4";
  {
    const FullDisk full(checkpoint.size() / 2);
    EXPECT_THAT(message_of([&] { train(run); }),
                AllOf(HasSubstr(folder_ / "run/checkpoint."), HasSubstr("File too large")));
  }
  EXPECT_EQ(read_file(first.checkpoint), checkpoint);
  run.overrides.push_back("train.checkpoint_every=1");
  EXPECT_EQ(train(run).updates, 4) << "from where it was, when there is room again";
}

}  // namespace
}  // namespace pictura
