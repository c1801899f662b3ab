#include "pictura/apps/corner_figure.h"

#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "pictura/cli/draw_chart.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/world.h"

namespace pictura {

namespace {

constexpr int kDotSteps = 5;  // steps between the dots of a path
constexpr int kTopSize_px = 560, kRowGap_px = 8;
constexpr float kCornerMargin_m = 8;
constexpr Rgb kUserColor = rgb8(73, 80, 87);

RgbImage from_above(const CornerResults& results, size_t pair, bool walls) {
  const CornerState& state = results.pairs[pair].hidden;
  const CornerScene& scene = results.scenes_of_pairs[pair];
  const CompiledMap& map = *results.maps[static_cast<size_t>(state.map)];
  const std::vector<Rgb> colors = chart_colors("SERIES_COLORS");
  std::vector<WorldMark> marks;
  for (size_t k = 0; k < scene.user_m.size(); k += kDotSteps) marks.push_back({scene.user_m[k], kUserColor, ""});
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    const Takeover& run = results.takeover(pair, walls, CornerCase::hidden, policy);
    const Rgb color = colors[policy % colors.size()];
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
  frame.caption = fmt::format("pair {}: {}, scene {}, step {}, {}", pair, results.setting.maps[state.map], state.scene,
                              state.step, walls ? "walls" : "no walls");
  const Vec2 size_m = shown.high - shown.low;
  WorldPainter painter(*map.road, kTopSize_px, kTopSize_px, walls ? map.geometry.walls : std::vector<WallFace>{});
  return painter.draw(
      frame, painter.around((shown.low + shown.high) * 0.5f, max_of(size_m.x, size_m.y) + 2 * kCornerMargin_m));
}

}  // namespace

void draw_corner_example(const CornerResults& results, const std::string& path) {
  const size_t pair = example_of(results);
  const RgbImage with_walls = from_above(results, pair, true), without = from_above(results, pair, false);
  RgbImage page{with_walls.width_px + kRowGap_px + without.width_px, with_walls.height_px, {}};
  page.rgb.assign(size_t{3} * static_cast<size_t>(page.width_px) * static_cast<size_t>(page.height_px), 255);
  paste(with_walls, 0, 0, &page);
  paste(without, with_walls.width_px + kRowGap_px, 0, &page);
  write_png(path, page.width_px, page.height_px, page.rgb);
}

}  // namespace pictura
