#include "pictura/apps/drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pictura/apps/draw_layers.h"
#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr Rgb kPanelColor = hex(0xFFFFFF);
constexpr Rgb kQuietText = hex(0x5A6068);

/// Sizes that grow with the picture.
struct Metrics {
  double unit;  // 1 for a picture of 1600 px
  double px(double at_1600) const { return std::max(1.0, at_1600 * unit); }
};

void draw_scale_bar(Canvas& canvas, const Metrics& m, double px_per_m) {
  // The longest round length that takes at most a fifth of the width.
  const double most_m = 0.2 * canvas.width_px() / px_per_m;
  const double power = std::pow(10.0, std::floor(std::log10(most_m)));
  const double length_m = most_m >= 5 * power ? 5 * power : (most_m >= 2 * power ? 2 * power : power);
  const double width = length_m * px_per_m, height = m.px(6);
  const double x = canvas.width_px() - m.px(24) - width, y = canvas.height_px() - m.px(22);
  canvas.fill_rectangle(x, y, width, height, hex(0x22262B));
  canvas.fill_rectangle(x + 0.25 * width, y + 0.25 * height, 0.25 * width, 0.5 * height, kPanelColor);
  canvas.fill_rectangle(x + 0.75 * width, y + 0.25 * height, 0.25 * width, 0.5 * height, kPanelColor);
  const TextStyle style{.size_px = m.px(14)};
  canvas.text(x, y - m.px(7), "0", style);
  canvas.text(x + width, y - m.px(7), fmt::format("{:g} m", length_m), {.size_px = m.px(14), .align = Align::right});
}

struct LegendEntry {
  std::string words;
  Rgb color;
  enum Shape { area, line, light } shape;
};

std::vector<LegendEntry> legend_of(const RoadMap& map) {
  std::vector<LegendEntry> entries;
  constexpr std::array<std::pair<LaneType, const char*>, 9> kTypes{{{LaneType::driving, "driving"},
                                                                    {LaneType::bidirectional, "both directions"},
                                                                    {LaneType::parking, "parking"},
                                                                    {LaneType::ramp, "ramp"},
                                                                    {LaneType::shoulder, "shoulder"},
                                                                    {LaneType::sidewalk, "sidewalk"},
                                                                    {LaneType::biking, "cycling"},
                                                                    {LaneType::median, "median"},
                                                                    {LaneType::other, "other"}}};
  for (const auto& [type, words] : kTypes) {
    const auto is_of_type = [wanted = type](const Lane& lane) { return lane.type == wanted; };
    const bool used = std::any_of(map.lanes.begin(), map.lanes.end(), is_of_type);
    if (used) entries.push_back({words, lane_color(type), LegendEntry::area});
  }
  if (!map.road_edges.empty()) entries.push_back({"road edge", hex(0xC8312F), LegendEntry::line});
  int32_t phases = 0;
  for (const Junction& junction : map.junctions) phases = std::max(phases, junction.num_phases);
  for (int32_t phase = 0; phase < std::min(phases, 6); ++phase) {
    entries.push_back({fmt::format("light, phase {}", phase), phase_color(phase), LegendEntry::light});
  }
  return entries;
}

void draw_legend(Canvas& canvas, const Metrics& m, const RoadMap& map, double top) {
  const TextStyle style{.size_px = m.px(13), .color = kQuietText};
  const double y = top, sample = m.px(20);
  double x = m.px(24);
  for (const LegendEntry& entry : legend_of(map)) {
    const double width = sample + m.px(7) + canvas.text_width(entry.words, style);
    if (x + width > canvas.width_px() - m.px(16)) return;
    const double middle = y - m.px(4.5);
    if (entry.shape == LegendEntry::area) canvas.fill_rectangle(x, middle - m.px(6), sample, m.px(12), entry.color);
    if (entry.shape == LegendEntry::line) canvas.fill_rectangle(x, middle - m.px(1), sample, m.px(2), entry.color);
    if (entry.shape == LegendEntry::light) {
      canvas.set_color(entry.color);
      cairo_arc(canvas.context(), x + 0.5 * sample, middle, m.px(6), 0, kTwoPi);
      cairo_fill(canvas.context());
    }
    canvas.text(x + sample + m.px(7), y, entry.words, style);
    x += width + m.px(20);
  }
}

}  // namespace

RgbImage draw_map(const RoadMap& map, int size_px) {
  PICTURA_CHECK(size_px >= 64 && size_px <= 16384, "picture of {}: expected a size of 64 to 16384 px, got {}", map.name,
                size_px);
  const Metrics m{size_px / 1600.0};
  // Above the map a band for its name and legend, below it a strip for the scale bar.
  const double band = m.px(96), margin = m.px(28), strip = m.px(36);
  const Aabb2 bounds = bounds_of(map);
  const double width_m = std::max(1.0f, bounds.high.x - bounds.low.x),
               height_m = std::max(1.0f, bounds.high.y - bounds.low.y);
  // The longer side of the whole picture, band included, is size_px; a narrow map still gets room for its title.
  const double room = size_px - 2 * margin;
  const double px_per_m = std::min(room / width_m, (room - band - strip) / height_m);
  const int width_px =
      std::clamp(static_cast<int>(std::ceil(width_m * px_per_m + 2 * margin)), size_px * 3 / 5, size_px);
  const int height_px =
      std::clamp(static_cast<int>(std::ceil(height_m * px_per_m + 2 * margin + band + strip)), 1, size_px);

  Canvas canvas(width_px, height_px, kGroundColor);
  const Vec2 left_top{static_cast<float>(0.5 * (bounds.low.x + bounds.high.x) - 0.5 * canvas.width_px() / px_per_m),
                      static_cast<float>(bounds.high.y + (margin + band) / px_per_m)};
  MapLayers(map).paint(canvas, left_top, px_per_m);
  for (const TrafficLight& light : map.lights) paint_light(canvas, light, left_top, px_per_m, phase_color(light.phase));

  canvas.fill_rectangle(0, 0, canvas.width_px(), band, kPanelColor);
  canvas.fill_rectangle(0, band, canvas.width_px(), m.px(1), hex(0xC9CCC4));
  const double after_name = m.px(24) + canvas.text(m.px(24), m.px(40), map.name, {.size_px = m.px(28), .bold = true});
  const MapFacts& facts = map.facts;
  canvas.text(
      after_name + m.px(20), m.px(40),
      fmt::format("{} roads   {} junctions ({} with lights)   {} driving lanes, {:.1f} km   {} lights   {} crosswalks",
                  facts.roads, facts.junctions, facts.signal_junctions, facts.driving_lanes, facts.driving_lane_km,
                  facts.traffic_lights, facts.crosswalks),
      {.size_px = m.px(15), .color = kQuietText});
  draw_legend(canvas, m, map, m.px(76));
  draw_scale_bar(canvas, m, px_per_m);
  return canvas.image();
}

void draw_map_png(const RoadMap& map, const std::string& path, int size_px) {
  const RgbImage image = draw_map(map, size_px);
  write_png(path, image.width_px, image.height_px, image.rgb);
}

}  // namespace pictura
