// Curves of training runs: means and bands over seeds, axes, names, and folders that are none.
#include "pictura/drawing/run_plot.h"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using testing::AllOf;
using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class RunPlots : public testing::Test {
 protected:
  /// A run of one update per line of `rows`: agent-steps, goals per 1,000 steps, seconds of collecting.
  std::string run(const std::string& name, int seed, const std::string& rows, const std::string& settings = "a = 1") {
    const std::string folder = folder_ / name;
    std::filesystem::create_directories(folder);
    std::string csv =
        "update,charts/agent_steps,driving/goals_per_1000_steps,time/rollout_s,time/update_s,a/kept,b/kept\n";
    int update = 0;
    std::istringstream lines(rows);
    for (std::string line; std::getline(lines, line);) csv += fmt::format("{},{},8,0,0\n", ++update, line);
    write_file(folder + "/progress.csv", csv);
    write_file(folder + "/config.toml",
               fmt::format("[run]\nseed = {}\ndevice = \"cpu\"\n[train]\n{}\n", seed, settings));
    return folder;
  }
  static RunPlotOptions goals() { return {.metrics = {"goals_per_1000_steps"}}; }

  test::ScratchFolder folder_;
};

TEST_F(RunPlots, SeedsOfOneConfigurationAreAMeanWithABandWhereAllOfThemAre) {
  const std::vector<std::string> folders{run("town_s1", 1, "0,0,1\n100,10,1\n200,20,1\n"),
                                         run("other", 1, "0,5,1\n50,6,1\n", "a = 2"),
                                         run("town_s2", 2, "100,4,1\n300,8,1\n")};
  const RunPlot plot = plot_runs(folders, goals());
  EXPECT_THAT(plot.columns, ElementsAre("driving/goals_per_1000_steps"));
  ASSERT_EQ(plot.lines.size(), 2u);
  EXPECT_EQ(plot.lines[0].name, "town_s*, 2 seeds");
  EXPECT_THAT(plot.lines[0].runs, ElementsAre(folders[0], folders[2]));
  EXPECT_THAT(plot.lines[0].seeds, ElementsAre(1, 2));
  EXPECT_EQ(plot.lines[1].name, "other");
  ASSERT_EQ(plot.panels.size(), 1u);
  EXPECT_EQ(plot.panels[0].title, "Goals");
  EXPECT_EQ(plot.panels[0].y_label, "per 1,000 agent-steps");
  EXPECT_EQ(plot.panels[0].x_label, "agent-steps");
  // Both are between 100 and 200 agent-steps: 10, 15, 20 and 4, 5, 6.
  const PlotSeries& mean = plot.panels[0].series.at(0);
  EXPECT_THAT(mean.x, ElementsAre(100, 150, 200));
  EXPECT_THAT(mean.y, ElementsAre(7, 10, 13));
  EXPECT_THAT(mean.low, ElementsAre(4, 5, 6));
  EXPECT_THAT(mean.high, ElementsAre(10, 15, 20));
  const PlotSeries& alone = plot.panels[0].series.at(1);
  EXPECT_THAT(alone.x, ElementsAre(0, 50));
  EXPECT_THAT(alone.y, ElementsAre(5, 6));
  EXPECT_TRUE(alone.low.empty());

  RunPlotOptions apart = goals();
  apart.group_seeds = false;
  EXPECT_EQ(plot_runs(folders, apart).lines.size(), 3u);
  std::filesystem::remove(folders[0] + "/config.toml");
  EXPECT_EQ(plot_runs(folders, apart).panels[0].series[2].name, "town_s2");
  EXPECT_THAT(message_of([&] { plot_runs(folders, goals()); }),
              AllOf(HasSubstr("town_s1/config.toml"), HasSubstr("none")));
}

TEST_F(RunPlots, AMeanHasAGapWhereASeedHasNoNumber) {
  const RunPlot plot =
      plot_runs({run("s1", 1, "0,nan,1\n10,1,1\n20,1,1\n"), run("s2", 2, "0,3,1\n10,3,1\n20,3,1\n")}, goals());
  const PlotSeries& mean = plot.panels[0].series.at(0);
  EXPECT_TRUE(std::isnan(mean.y[0]) && std::isnan(mean.low[0]) && std::isnan(mean.high[0]));
  EXPECT_EQ(mean.y[1], 2);
  EXPECT_EQ(mean.y[2], 2);
}

TEST_F(RunPlots, HoursAreThoseOfCollectingAndImproving) {
  RunPlotOptions options = goals();
  options.x = RunAxis::hours;
  // 8 s of improving each.
  const RunPlot plot = plot_runs({run("s1", 1, "0,1,1792\n10,2,3592\n")}, options);
  EXPECT_EQ(plot.panels[0].x_label, "hours");
  EXPECT_THAT(plot.panels[0].series[0].x, ElementsAre(DoubleEq(0.5), DoubleEq(1.5)));
}

TEST_F(RunPlots, ManyUpdatesAreFewPoints) {
  std::string rows;
  for (int i = 0; i < 3000; ++i) rows += fmt::format("{},{},1\n", i, i % 15);
  const RunPlot plot = plot_runs({run("s1", 1, rows)}, goals());
  const PlotSeries& series = plot.panels[0].series[0];
  ASSERT_EQ(series.x.size(), kMaxRunPoints);
  EXPECT_EQ(series.x[0], 7);
  EXPECT_EQ(series.x.back(), 2992);
  for (const double y : series.y) EXPECT_EQ(y, 7);
}

TEST_F(RunPlots, NamesAreThoseOfFoldersAndWholeWhereTheyAreAlike) {
  const std::string a = run("a/run", 1, "0,1,1\n", "a = 1"), b = run("b/run", 1, "0,1,1\n", "a = 2");
  EXPECT_EQ(plot_runs({a}, goals()).lines[0].name, "run");
  EXPECT_EQ(plot_runs({a + "/"}, goals()).lines[0].name, "run");
  const RunPlot both = plot_runs({a, b}, goals());
  EXPECT_EQ(both.lines[0].name, a);
  EXPECT_EQ(both.lines[1].name, b);
  // What names have in common at their beginning and end does not overlap.
  const RunPlot seeds = plot_runs({run("aa", 1, "0,1,1\n"), run("aaa", 2, "0,1,1\n")}, goals());
  EXPECT_EQ(seeds.lines[0].name, "aa*, 2 seeds");
}

TEST_F(RunPlots, WhatIsMissingIsNamed) {
  const std::string a = run("a", 1, "0,1,1\n10,1,1\n");
  const auto message = [](const std::vector<std::string>& runs, RunPlotOptions options = goals()) {
    return message_of([&] { plot_runs(runs, options); });
  };
  EXPECT_THAT(message({folder_ / "nowhere"}), HasSubstr("nowhere: expected the folder of a training run"));
  std::filesystem::create_directories(folder_ / "empty");
  EXPECT_THAT(message({folder_ / "empty"}), AllOf(HasSubstr("/empty: "), HasSubstr("no progress.csv")));
  EXPECT_THAT(message({run("young", 1, "")}), HasSubstr("young/progress.csv: has no update yet"));
  EXPECT_THAT(message({a, a + "/."}), HasSubstr("is the same folder as"));
  EXPECT_THAT(message({a}, {.metrics = {"speed"}}),
              AllOf(HasSubstr("a/progress.csv: expected a column 'speed'"), HasSubstr("time/rollout_s")));
  EXPECT_THAT(message({a}, {.metrics = {"kept"}}), HasSubstr("'kept' may be a/kept or b/kept"));
  EXPECT_THAT(message({a}, {.metrics = {"a/kept"}}), Not(HasSubstr("may be")));
  write_file(a + "/progress.csv", "update,charts/agent_steps,charts/agent_steps\n1,2,3\n");
  EXPECT_THAT(message({a}), HasSubstr("a/progress.csv:1: column 'charts/agent_steps' stands twice"));
  write_file(a + "/progress.csv", "update,charts/agent_steps,driving/goals_per_1000_steps\n1,2,3\n2,x,3\n");
  EXPECT_THAT(message({a}), HasSubstr("a/progress.csv:3: expected 3 numbers, got 'x' as number 2"));
  write_file(a + "/progress.csv", "update,charts/agent_steps,driving/goals_per_1000_steps\n1,2,3\n");
  RunPlotOptions hours = goals();
  hours.x = RunAxis::hours;
  EXPECT_THAT(message({a}, hours), HasSubstr("expected a column 'time/rollout_s'"));
  EXPECT_THAT(message({a, run("b", 2, "50,1,1\n60,1,1\n")}), HasSubstr("no stretch in common"));
  write_file(a + "/config.toml", "[run]\ndevice = \"cpu\"\n");
  EXPECT_THAT(message({a}), HasSubstr("a/config.toml: expected a number run.seed"));
}

}  // namespace
}  // namespace pictura
