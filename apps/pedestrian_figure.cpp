#include "pictura/apps/pedestrian_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/film.h"
#include "pictura/drawing/plot.h"
#include "pictura/drawing/world.h"
#include "pictura/evaluation/probes/crossing_path.h"

namespace pictura {

namespace {

constexpr int kTopWidth_px = 620, kTopHeight_px = 640, kPlotWidth_px = 612, kGap_px = 8, kEnlargement_px = 288;
constexpr float kPedestrianMargin_m = 12;
constexpr uint8_t kPageGrey = 255;

struct Quantity {
  const char *title, *label;
  double (PairedResponse::*change)() const;
  Estimate ResponseMeans::* mean;
};
constexpr Quantity kQuantities[] = {
    {"Value", "dV", &PairedResponse::value_change, &ResponseMeans::value_change},
    {"Braking probability", "dP(brake)", &PairedResponse::brake_change, &ResponseMeans::brake_change}};

// Green where the pedestrian is seen whole, red where it is hidden.
Rgb color_of(double visible_share) {
  constexpr Rgb kHidden = rgb8(201, 42, 42), kHalf = rgb8(245, 196, 46), kWhole = rgb8(43, 138, 62);
  const auto mixed = [](Rgb a, Rgb b, double share) {
    const auto of_b = static_cast<float>(share);
    return Rgb{a.r + (b.r - a.r) * of_b, a.g + (b.g - a.g) * of_b, a.b + (b.b - a.b) * of_b};
  };
  return visible_share < 0.5 ? mixed(kHidden, kHalf, 2 * visible_share) : mixed(kHalf, kWhole, 2 * visible_share - 1);
}

// Points of a path whose images are shown: hidden, first seen, seen best, last seen, and hidden again.
std::array<int32_t, 5> places_of(const PedestrianResults& results, const PedestrianPath& path) {
  const auto first = results.points.begin() + path.first_point;
  const auto less = [](const PedestrianPoint& a, const PedestrianPoint& b) {
    return a.visible_share < b.visible_share;
  };
  const auto best = std::max_element(first + path.first_seen, first + path.hidden_again, less);
  return {path.first_seen / 2, path.first_seen, static_cast<int32_t>(best - first), path.hidden_again - 1,
          (path.hidden_again + path.num_points) / 2};
}

std::string letter(size_t place) { return std::string(1, static_cast<char>('a' + place)); }

class PathFigures {
 public:
  explicit PathFigures(const PedestrianResults& results) : results_(results) {
    RendererConfig config = results.cameras;
    config.device = {};
    config.samples = {};
    Rig rig;
    for (const int camera : film_order(config.rig))
      rig.cameras.push_back(config.rig.cameras[static_cast<size_t>(camera)]);
    config.rig = rig;
    renderer_ = make_renderer("cpu", config);
    upload_maps(results.maps, {}, renderer_.get());
  }

  RgbImage draw(size_t index) {
    const PedestrianPath& path = results_.paths[index];
    const std::array<int32_t, 5> places = places_of(results_, path);
    const RgbImage top = from_above(index, places), curves = along(path, places), sheet = cameras_at(path, places);
    RgbImage page{std::max(top.width_px + kGap_px + curves.width_px, sheet.width_px),
                  std::max(top.height_px, curves.height_px) + kGap_px + sheet.height_px,
                  {}};
    page.rgb.assign(size_t{3} * static_cast<size_t>(page.width_px) * static_cast<size_t>(page.height_px), kPageGrey);
    paste(top, 0, 0, &page);
    paste(curves, top.width_px + kGap_px, 0, &page);
    paste(sheet, 0, page.height_px - sheet.height_px, &page);
    return page;
  }

 private:
  const PedestrianPoint& point(const PedestrianPath& path, int32_t at) const {
    return results_.points[static_cast<size_t>(path.first_point + at)];
  }

  RgbImage from_above(size_t index, const std::array<int32_t, 5>& places) {
    const PedestrianPath& path = results_.paths[index];
    const CompiledMap& map = *results_.maps[static_cast<size_t>(path.map)];
    std::unique_ptr<WorldPainter>& painter = painters_[path.map];
    if (!painter) {
      painter = std::make_unique<WorldPainter>(*map.road, kTopWidth_px, kTopHeight_px, map.geometry.walls);
    }
    std::vector<WorldMark> marks;
    Aabb2 shown{path.view.origin_m.xy(), path.view.origin_m.xy()};
    for (int32_t at = 0; at < path.num_points; ++at) {
      const Vec2 position_m = point(path, at).pedestrian.center_m.xy();
      marks.push_back({position_m, color_of(static_cast<double>(point(path, at).visible_share)), ""});
      shown = {{min_of(shown.low.x, position_m.x), min_of(shown.low.y, position_m.y)},
               {max_of(shown.high.x, position_m.x), max_of(shown.high.y, position_m.y)}};
    }
    for (size_t place = 0; place < places.size(); ++place) {
      const auto at = static_cast<size_t>(places[place]);
      marks.push_back({marks[at].position_m, marks[at].color, letter(place)});
    }
    WorldFrame frame;
    frame.agents = path.boxes;
    frame.status = path.status;
    frame.lights = path.lights;
    frame.highlighted = path.ego;
    frame.marks = marks;
    frame.caption = fmt::format("path {}: {}, scene {}, step {}, agent {} at {:.1f} m/s", index,
                                results_.setting.maps[static_cast<size_t>(path.map)], path.scene, path.step, path.ego,
                                path.ego_speed_mps);
    const Vec2 size_m = shown.high - shown.low;
    const float width_m = max_of(size_m.x, size_m.y) + 2 * kPedestrianMargin_m;
    return painter->draw(frame, painter->around((shown.low + shown.high) * 0.5f, width_m));
  }

  RgbImage along(const PedestrianPath& path, const std::array<int32_t, 5>& places) const {
    std::vector<PlotPanel> panels;
    for (const Quantity& quantity : kQuantities) {
      PlotPanel panel{.title = quantity.title, .x_label = "along the path (m)", .y_label = quantity.label};
      for (size_t policy = 0; policy < results_.policies.size(); ++policy) {
        PlotSeries series{.name = results_.policies[policy].answers_as()};
        for (int32_t at = 0; at < path.num_points; ++at) {
          series.x.push_back(static_cast<double>(point(path, at).along_m));
          series.y.push_back(
              (results_.response(static_cast<size_t>(path.first_point + at), policy).*quantity.change)());
        }
        panel.series.push_back(std::move(series));
      }
      for (int32_t at = 0; at < path.num_points; ++at) {
        const PedestrianPoint& one = point(path, at);
        panel.strip.push_back({static_cast<double>(one.along_m), color_of(static_cast<double>(one.visible_share))});
      }
      for (size_t place = 0; place < places.size(); ++place)
        panel.marks.push_back({static_cast<double>(point(path, places[place]).along_m), letter(place)});
      panels.push_back(std::move(panel));
    }
    return draw_plots(panels,
                      {.panel_width_px = kPlotWidth_px, .panel_height_px = 305, .columns = 1, .one_legend = true});
  }

  RgbImage cameras_at(const PedestrianPath& path, const std::array<int32_t, 5>& places) {
    const auto num_boxes = static_cast<int32_t>(path.boxes.size());
    std::vector<AgentBox> boxes = path.boxes;
    std::vector<int32_t> hidden;
    std::vector<View> views;
    std::vector<std::string> names;
    for (size_t place = 0; place < places.size(); ++place) {
      boxes.push_back(point(path, places[place]).pedestrian);
      View view = path.view;
      view.hidden_begin = static_cast<int32_t>(hidden.size());
      for (size_t other = 0; other < places.size(); ++other) {
        if (other != place) hidden.push_back(num_boxes + static_cast<int32_t>(other));
      }
      view.hidden_end = static_cast<int32_t>(hidden.size());
      views.push_back(view);
      names.push_back(fmt::format("{} {:.0f} m", letter(place), point(path, places[place]).along_m));
    }
    const std::vector<int32_t> world_begin{0, static_cast<int32_t>(boxes.size())},
        light_begin{0, static_cast<int32_t>(path.lights.size())};
    const std::vector<GeometryHandle> geometry{path.map};
    const Rig& rig = renderer_->config().rig;
    HostImages images(rig, static_cast<int>(views.size()));
    renderer_->render({{}, world_begin, boxes, geometry, light_begin, path.lights, hidden}, {Span<const View>(views)},
                      images.batch());
    return contact_sheets(images, rig, names, std::max(1, kEnlargement_px / rig.cameras[0].width_px))[0];
  }

  const PedestrianResults& results_;
  std::unique_ptr<Renderer> renderer_;
  std::map<int32_t, std::unique_ptr<WorldPainter>> painters_;  // by map
};

void draw_means(const PedestrianResults& results, const std::vector<PedestrianRow>& rows, const std::string& path) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<PlotPanel> panels;
  for (const Quantity& quantity : kQuantities) {
    PlotPanel panel{.title = quantity.title, .x_label = "from where it is first seen (m)", .y_label = quantity.label};
    for (const ProbedPolicy& policy : results.policies) panel.series.push_back({.name = policy.answers_as()});
    for (const PedestrianRow& row : rows) {
      // Where most paths have a point: the ends are of few.
      if (!row.offset || 2 * row.cases < static_cast<int64_t>(results.paths.size())) continue;
      PlotSeries& series = panel.series[static_cast<size_t>(row.policy)];
      const Estimate& mean = row.*quantity.mean;
      const bool has_band = std::isfinite(mean.half_width_95);
      const double x = static_cast<double>(kPathSpacing_m) * *row.offset;
      series.x.push_back(x);
      series.y.push_back(mean.value);
      series.low.push_back(has_band ? mean.value - mean.half_width_95 : nothing);
      series.high.push_back(has_band ? mean.value + mean.half_width_95 : nothing);
      if (row.policy == 0) panel.strip.push_back({x, color_of(row.mean_visible_share)});
    }
    panels.push_back(std::move(panel));
  }
  draw_plots_png(panels, path, {.panel_width_px = 520, .panel_height_px = 330, .columns = 2, .one_legend = true});
}

}  // namespace

void draw_pedestrian_figures(const PedestrianResults& results, const std::vector<PedestrianRow>& rows,
                             FilledFolder* folder, const std::function<void(size_t)>& on_path) {
  PathFigures figures(results);
  for (size_t i = 0; i < results.paths.size(); ++i) {
    const RgbImage page = figures.draw(i);
    write_png(folder->file(fmt::format("path_{:03}.png", i)), page.width_px, page.height_px, page.rgb);
    on_path(i + 1);
  }
  draw_means(results, rows, folder->file("pedestrian.png"));
}

}  // namespace pictura
