// Evaluations along trainings: lines at medium density, bands of all, dashes, and files that are none.
#include "pictura/drawing/evaluation_plot.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// A row of `pictura evaluate --json` whose rates and goals are `value`, with a distance per infraction of `km`.
std::string row(const std::string& density, double value, const std::string& km = "1") {
  return fmt::format(R"({{"density": "{}", "at_fault_collision_rate": {}, "off_road_rate": {}, "red_light_rate": {}, )"
                     R"("goals_per_vehicle": {}, "km_per_infraction": {}}})",
                     density, value, value, value, value, km);
}
std::string point(double agent_steps, const std::string& rows) {
  return fmt::format(R"({{"agent_steps": {}, "gpu_hours": {}, "rows": [{}]}})", agent_steps, agent_steps / 1000, rows);
}

class EvaluationPlots : public testing::Test {
 protected:
  std::string file(const std::string& lines) {
    const std::string path = folder_ / "curves.json";
    write_file(path, fmt::format(R"({{"lines": [{}]}})", lines));
    return path;
  }
  test::ScratchFolder folder_;
};

TEST_F(EvaluationPlots, LinesAreMediumTrafficInABandOfAllDensities) {
  const std::string path = file(
      fmt::format(R"({{"name": "agent", "points": [{}, {}]}}, {{"name": "baseline", "dashed": true, "points": [{}]}})",
                  point(1000, row("light", 1) + "," + row("medium", 3) + "," + row("dense", 2)),
                  point(3000, row("dense", 5) + "," + row("medium", 4, "null")), point(2000, row("medium", 7))));
  const std::vector<PlotPanel> panels = plot_evaluations(path, RunAxis::agent_steps);
  ASSERT_EQ(panels.size(), 5u);
  for (size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(panels[i].series.size(), 2u);
    const PlotSeries &agent = panels[i].series[0], &baseline = panels[i].series[1];
    EXPECT_EQ(agent.name, "agent");
    EXPECT_FALSE(agent.dashed);
    EXPECT_THAT(agent.x, ElementsAre(1000, 3000));
    EXPECT_THAT(agent.y, ElementsAre(3, 4));
    EXPECT_THAT(agent.low, ElementsAre(1, 4));
    EXPECT_THAT(agent.high, ElementsAre(3, 5));
    EXPECT_TRUE(baseline.dashed);
    EXPECT_THAT(baseline.y, ElementsAre(7));
  }
  // Without an infraction at medium density there is no distance per infraction.
  EXPECT_TRUE(std::isnan(panels[4].series[0].y[1]));
  EXPECT_EQ(panels[4].series[0].low[1], 1);
  EXPECT_THAT(plot_evaluations(path, RunAxis::hours)[0].series[0].x, ElementsAre(1, 3));
  // Dashes leave gaps: less of the picture is of the line's colour.
  PlotPanel solid = panels[3];
  solid.series[0].dashed = true;
  const auto colored = [](const RgbImage& image) {
    const Rgb color = series_color(0);
    int count = 0;
    for (size_t i = 0; i < image.rgb.size(); i += 3) {
      count += std::abs(image.rgb[i] - 255 * color.r) < 2 && std::abs(image.rgb[i + 1] - 255 * color.g) < 2 &&
               std::abs(image.rgb[i + 2] - 255 * color.b) < 2;
    }
    return count;
  };
  EXPECT_LT(colored(draw_plots({solid})), 0.8 * colored(draw_plots({panels[3]})));
}

TEST_F(EvaluationPlots, DistancesPerInfractionArePanelsWhereRowsHaveThem) {
  const auto titles_of_distances = [&](const std::string& rows) {
    std::vector<std::string> titles;
    const std::string path = file(fmt::format(R"({{"name": "agent", "points": [{}]}})", point(1000, rows)));
    for (const PlotPanel& panel : plot_evaluations(path, RunAxis::agent_steps)) titles.push_back(panel.title);
    titles.erase(titles.begin(), titles.begin() + 4);
    return titles;
  };
  const std::string both = row("medium", 1, R"(2, "km_per_at_fault_infraction": 3)");
  std::string old = row("medium", 1);
  old.replace(old.find("km_per_infraction"), 17, "km_per_at_fault_infraction");
  EXPECT_THAT(titles_of_distances(row("medium", 1)), ElementsAre("Distance per infraction"));
  EXPECT_THAT(titles_of_distances(old), ElementsAre("Distance per at-fault infraction"));
  EXPECT_THAT(titles_of_distances(both), ElementsAre("Distance per infraction", "Distance per at-fault infraction"));
  // A line of both kinds has a gap where a point lacks one.
  const std::string path =
      file(fmt::format(R"({{"name": "agent", "points": [{}, {}]}})", point(1000, old), point(2000, both)));
  const std::vector<PlotPanel> panels = plot_evaluations(path, RunAxis::agent_steps);
  EXPECT_TRUE(std::isnan(panels[4].series[0].y[0]));
  EXPECT_EQ(panels[4].series[0].y[1], 2);
  EXPECT_THAT(panels[5].series[0].y, ElementsAre(1, 3));
}

TEST_F(EvaluationPlots, WhatIsMissingIsNamed) {
  const auto message = [&](const std::string& lines) {
    return message_of([&] { plot_evaluations(file(lines), RunAxis::agent_steps); });
  };
  EXPECT_THAT(message(""), AllOf(HasSubstr("curves.json"), HasSubstr("expected a line or more")));
  EXPECT_THAT(message(R"({"points": []})"), AllOf(HasSubstr("line 1"), HasSubstr("name")));
  EXPECT_THAT(message(R"({"name": "a", "points": []})"), AllOf(HasSubstr("line 'a'"), HasSubstr("a point or more")));
  EXPECT_THAT(message(fmt::format(R"({{"name": "a", "points": [{}]}})", point(1, row("light", 1)))),
              AllOf(HasSubstr("line 'a'"), HasSubstr("medium")));
  EXPECT_THAT(message(fmt::format(R"({{"name": "a", "points": [{}, {}]}})", point(2, row("medium", 1)),
                                  point(1, row("medium", 1)))),
              HasSubstr("ascending"));
  EXPECT_THAT(message(R"({"name": "a", "points": [{"agent_steps": 1, "rows": [{"density": "medium"}]}]})"),
              AllOf(HasSubstr("line 'a'"), HasSubstr("at_fault_collision_rate")));
  write_file(folder_ / "text.json", "curves");
  EXPECT_THAT(message_of([&] { plot_evaluations(folder_ / "text.json", RunAxis::hours); }),
              AllOf(HasSubstr("text.json"), HasSubstr("parse error")));
}

}  // namespace
}  // namespace pictura
