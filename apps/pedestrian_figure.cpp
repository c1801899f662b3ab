#include "pictura/apps/pedestrian_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/cli/draw_chart.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/film.h"
#include "pictura/drawing/world.h"
#include "pictura/evaluation/probes/crossing_path.h"

namespace pictura {

namespace {

constexpr int kTopHeight_px = 560, kGap_px = 8, kEnlargement_px = 288;
constexpr float kPedestrianMargin_m = 12;
constexpr uint8_t kPageGrey = 255;

Rgb mixed(Rgb a, Rgb b, float share_of_b) {
  return {a.r + (b.r - a.r) * share_of_b, a.g + (b.g - a.g) * share_of_b, a.b + (b.b - a.b) * share_of_b};
}

// Returns the points of a path whose images are shown: where the pedestrian is hidden, first seen, best seen, last
// seen, and hidden again.
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
    for (const int camera : film_order(config.rig)) rig.cameras.push_back(config.rig.cameras[camera]);
    config.rig = rig;
    renderer_ = make_renderer("cpu", config);
    upload_maps(results.maps, {}, renderer_.get());
  }

  RgbImage draw(size_t index) {
    const PedestrianPath& path = results_.paths[index];
    const std::array<int32_t, 5> places = places_of(results_, path);
    const RgbImage sheet = cameras_at(path, places), top = from_above(index, places, sheet.width_px);
    RgbImage page{sheet.width_px, top.height_px + kGap_px + sheet.height_px, {}};
    page.rgb.assign(size_t{3} * static_cast<size_t>(page.width_px) * static_cast<size_t>(page.height_px), kPageGrey);
    paste(top, 0, 0, &page);
    paste(sheet, 0, top.height_px + kGap_px, &page);
    return page;
  }

  /// Returns the page of a path for pictura.plot.
  Json page(size_t index, const std::string& picture) const {
    const PedestrianPath& path = results_.paths[index];
    const std::array<int32_t, 5> places = places_of(results_, path);
    Json marks = Json::array();
    for (size_t place = 0; place < places.size(); ++place) {
      marks.push_back({point(path, places[place]).along_m, letter(place)});
    }
    return {{"picture", picture}, {"path", index}, {"marks", marks}};
  }

 private:
  const PedestrianPoint& point(const PedestrianPath& path, int32_t at) const {
    return results_.points[path.first_point + at];
  }

  /// Interpolates between three colours of the chart, which mean hidden, half visible and fully visible.
  Rgb color_of(float visible_share) const {
    return visible_share < 0.5f ? mixed(colors_[0], colors_[1], 2 * visible_share)
                                : mixed(colors_[1], colors_[2], 2 * visible_share - 1);
  }

  RgbImage from_above(size_t index, const std::array<int32_t, 5>& places, int width_px) {
    const PedestrianPath& path = results_.paths[index];
    const CompiledMap& map = *results_.maps[path.map];
    std::unique_ptr<WorldPainter>& painter = painters_[path.map];
    if (!painter) {
      painter = std::make_unique<WorldPainter>(*map.road, width_px, kTopHeight_px, map.geometry.walls);
    }
    std::vector<WorldMark> marks;
    Aabb2 shown{path.view.origin_m.xy(), path.view.origin_m.xy()};
    for (int32_t at = 0; at < path.num_points; ++at) {
      const Vec2 position_m = point(path, at).pedestrian.center_m.xy();
      marks.push_back({position_m, color_of(point(path, at).visible_share), ""});
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
                                results_.setting.maps[path.map], path.scene, path.step, path.ego, path.ego_speed_mps);
    const Vec2 size_m = shown.high - shown.low;
    const float height_m = max_of(size_m.x, size_m.y) + 2 * kPedestrianMargin_m;
    const float width_m = height_m * static_cast<float>(width_px) / kTopHeight_px;
    return painter->draw(frame, painter->around((shown.low + shown.high) * 0.5f, width_m));
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
  const std::vector<Rgb> colors_ = chart_colors("SHARE_COLORS");
};

}  // namespace

Json draw_pedestrian_paths(const PedestrianResults& results, FilledFolder* folder,
                           const std::function<void(size_t)>& on_path) {
  PathFigures figures(results);
  Json pages = Json::array();
  for (size_t i = 0; i < results.paths.size(); ++i) {
    const RgbImage page = figures.draw(i);
    const std::string picture = fmt::format("path_{:03}.png", i);
    write_png(folder->file(picture), page.width_px, page.height_px, page.rgb);
    pages.push_back(figures.page(i, picture));
    on_path(i + 1);
  }
  return pages;
}

}  // namespace pictura
