#include "pictura/apps/corner_figure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "pictura/drawing/drawing.h"
#include "pictura/drawing/plot.h"
#include "pictura/drawing/world.h"

namespace pictura {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr int kDotSteps = 5;  // between dots of a way
constexpr int kTopSize_px = 560, kGap_px = 8;
constexpr float kCornerMargin_m = 8;
constexpr Rgb kUserColor = rgb8(73, 80, 87), kRevealColor = rgb8(134, 142, 150), kOtherColor = rgb8(233, 236, 239);

const char* title_of(CornerCase its_case) {
  switch (its_case) {
    case CornerCase::hidden: return "hidden vehicle";
    case CornerCase::removed: return "the same without it";
    default: return "empty corner";
  }
}

std::string with_walls(const char* title, bool walls) {
  return fmt::format("{}, {}", title, walls ? "walls" : "no walls");
}

// When line of sight opens, over all policies.
std::vector<PlotCell> reveal_strip(const CornerResults& results, bool walls) {
  std::vector<int32_t> reveals;
  for (size_t pair = 0; pair < results.pairs.size(); ++pair) {
    for (size_t policy = 0; policy < results.policies.size(); ++policy) {
      const auto reveal = reveal_of(results, pair, walls, CornerCase::hidden, policy);
      if (reveal) reveals.push_back(reveal->step);
    }
  }
  if (reveals.empty()) return {};
  std::sort(reveals.begin(), reveals.end());
  const int32_t first = reveals[reveals.size() / 10], last = reveals[reveals.size() - 1 - reveals.size() / 10];
  std::vector<PlotCell> strip;
  for (int32_t k = 0; k <= kTakeoverSteps; ++k)
    strip.push_back({kTakeoverStep_s * k, k >= first && k <= last ? kRevealColor : kOtherColor});
  return strip;
}

void draw_means(const CornerResults& results, const std::vector<CornerRow>& rows, const std::string& path) {
  std::vector<PlotPanel> panels;
  for (const bool walls : {true, false}) {
    for (const CornerCase its_case : {CornerCase::hidden, CornerCase::removed, CornerCase::empty}) {
      PlotPanel panel{.title = with_walls(title_of(its_case), walls),
                      .x_label = "since the takeover (s)",
                      .y_label = "mean speed (m/s)",
                      .strip = reveal_strip(results, walls)};
      for (const CornerRow& row : rows) {
        if (row.walls != walls || row.its_case != its_case || row.less_policy || row.less_case) continue;
        PlotSeries series{.name = results.policies[row.policy].answers_as()};
        for (size_t k = 0; k < row.speed_mps.size(); ++k) {
          const Estimate& speed = row.speed_mps[k];
          const bool has_band = std::isfinite(speed.half_width_95);
          series.x.push_back(kTakeoverStep_s * static_cast<double>(k));
          series.y.push_back(row.driving[k] > 0 ? speed.value : kNothing);
          series.low.push_back(has_band ? speed.value - speed.half_width_95 : kNothing);
          series.high.push_back(has_band ? speed.value + speed.half_width_95 : kNothing);
        }
        panel.series.push_back(std::move(series));
      }
      panels.push_back(std::move(panel));
    }
  }
  draw_plots_png(panels, path, {.panel_width_px = 400, .panel_height_px = 300, .columns = 3, .one_legend = true});
}

RgbImage from_above(const CornerResults& results, size_t pair, bool walls) {
  const CornerState& state = results.pairs[pair].hidden;
  const CornerScene& scene = results.scenes_of_pairs[pair];
  const CompiledMap& map = *results.maps[static_cast<size_t>(state.map)];
  std::vector<WorldMark> marks;
  for (size_t k = 0; k < scene.user_m.size(); k += kDotSteps) marks.push_back({scene.user_m[k], kUserColor, ""});
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    const Takeover& run = results.takeover(pair, walls, CornerCase::hidden, policy);
    const Rgb color = series_color(policy);
    const auto add = [&](int32_t step, const char* label) {
      const auto k = static_cast<size_t>(step);
      if (step >= 0 && std::isfinite(run.x_m[k])) marks.push_back({{run.x_m[k], run.y_m[k]}, color, label});
    };
    for (int32_t k = 0; k <= kTakeoverSteps; k += kDotSteps) add(k, "");
    add(run.input_step, "x");
    if (walls) add(run.sight_step, "o");
  }
  Aabb2 shown{state.view.origin_m.xy(), state.view.origin_m.xy()};
  for (const WorldMark& mark : marks) {
    shown = {{min_of(shown.low.x, mark.position_m.x), min_of(shown.low.y, mark.position_m.y)},
             {max_of(shown.high.x, mark.position_m.x), max_of(shown.high.y, mark.position_m.y)}};
  }
  WorldFrame frame;
  frame.agents = scene.boxes;
  frame.status = scene.status;
  frame.highlighted = state.ego;
  frame.marks = marks;
  frame.caption =
      fmt::format("pair {}: {}, scene {}, step {}, {}", pair, results.setting.maps[static_cast<size_t>(state.map)],
                  state.scene, state.step, walls ? "walls" : "no walls");
  const Vec2 size_m = shown.high - shown.low;
  WorldPainter painter(*map.road, kTopSize_px, kTopSize_px, walls ? map.geometry.walls : std::vector<WallFace>{});
  return painter.draw(
      frame, painter.around((shown.low + shown.high) * 0.5f, max_of(size_m.x, size_m.y) + 2 * kCornerMargin_m));
}

RgbImage speeds_of(const CornerResults& results, size_t pair, bool walls) {
  PlotPanel panel{.title = with_walls("Speed towards the hidden vehicle", walls),
                  .x_label = "since the takeover (s); x: it enters the input, o: line of sight opens",
                  .y_label = "speed (m/s)"};
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    const Takeover& run = results.takeover(pair, walls, CornerCase::hidden, policy);
    PlotSeries series{.name = results.policies[policy].answers_as()};
    for (size_t k = 0; k < run.speed_mps.size(); ++k) {
      series.x.push_back(kTakeoverStep_s * static_cast<double>(k));
      series.y.push_back(static_cast<double>(run.speed_mps[k]));
    }
    panel.series.push_back(std::move(series));
    if (run.input_step >= 0) panel.marks.push_back({kTakeoverStep_s * run.input_step, "x"});
    if (walls && run.sight_step >= 0) panel.marks.push_back({kTakeoverStep_s * run.sight_step, "o"});
  }
  return draw_plots({panel}, {.panel_width_px = kTopSize_px, .panel_height_px = 280, .columns = 1});
}

void draw_example(const CornerResults& results, const std::string& path) {
  const size_t pair = example_of(results);
  RgbImage page;
  for (const bool walls : {true, false}) {
    const RgbImage top = from_above(results, pair, walls), speeds = speeds_of(results, pair, walls);
    const int column_px = std::max(top.width_px, speeds.width_px) + kGap_px;
    if (walls) {
      page = {2 * column_px, top.height_px + kGap_px + speeds.height_px, {}};
      page.rgb.assign(size_t{3} * static_cast<size_t>(page.width_px) * static_cast<size_t>(page.height_px), 255);
    }
    const int left_px = walls ? 0 : column_px;
    paste(top, left_px, 0, &page);
    paste(speeds, left_px, top.height_px + kGap_px, &page);
  }
  write_png(path, page.width_px, page.height_px, page.rgb);
}

}  // namespace

void draw_corner_figures(const CornerResults& results, const std::vector<CornerRow>& rows, FilledFolder* folder) {
  draw_means(results, rows, folder->file("corner.png"));
  draw_example(results, folder->file("example.png"));
}

}  // namespace pictura
