#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/map_details.h"
#include "pictura/drawing/ticks.h"
#include "pictura/drawing/tracks.h"

namespace pictura {

namespace {

constexpr Rgb kPanelColor = hex(0xFFFFFF), kPanelLine = hex(0xC9CCC4);
constexpr Rgb kQuietText = hex(0x5A6068), kInk = hex(0x22262B);

/// Sizes in pixels that scale with the picture.
struct Metrics {
  double unit;  // 1 for a picture of 1600 px
  double px(double at_1600) const { return std::max(1.0, at_1600 * unit); }
};

struct LegendEntry {
  std::string label;
  Rgb color;
  enum Shape { area, frame, bars, line, light, sign } shape;
};

bool has_lanes_of(const RoadMap& map, LaneType type) {
  return std::any_of(map.lanes.begin(), map.lanes.end(), [&](const Lane& lane) { return lane.type == type; });
}

bool has_markings_of(const RoadMap& map, MarkColor color) {
  return std::any_of(map.markings.begin(), map.markings.end(), [&](const Marking& m) { return m.color == color; });
}

void add_tracks(const Scenario& scenario, std::vector<LegendEntry>* entries_out) {
  if (scenario.sdc_track >= 0) entries_out->push_back({"self-driving car", kSdcInk, LegendEntry::area});
  for (int i = 0; i <= static_cast<int>(TrackType::other); ++i) {
    const auto type = static_cast<TrackType>(i);
    const bool has_any = std::any_of(scenario.tracks.begin(), scenario.tracks.end(),
                                     [&](const RecordedTrack& track) { return track.type == type; });
    if (has_any)
      entries_out->push_back({fmt::format("{} track", to_string(type)), track_color(type), LegendEntry::area});
  }
}

/// Returns an entry for each kind of element of the map, and for each kind of track of the scenario, if given.
std::vector<LegendEntry> legend_of(const RoadMap& map, const Scenario* scenario) {
  std::vector<LegendEntry> entries;
  for (int i = 0; i <= static_cast<int>(LaneType::other); ++i) {
    const auto type = static_cast<LaneType>(i);
    if (has_lanes_of(map, type)) entries.push_back({to_string(type), lane_color(type), LegendEntry::area});
  }
  for (int i = 0; i <= static_cast<int>(MarkColor::black); ++i) {
    const auto color = static_cast<MarkColor>(i);
    if (!has_markings_of(map, color)) continue;
    entries.push_back({fmt::format("{} line", to_string(color)), paint_color(color), LegendEntry::line});
  }
  const auto add_if = [&](bool used, const char* label, Rgb color, LegendEntry::Shape shape) {
    if (used) entries.push_back({label, color, shape});
  };
  add_if(!map.stop_lines.empty(), "painted stop line", kStopLineInk, LegendEntry::line);
  add_if(!map.crosswalks.empty(), "crosswalk", paint_color(MarkColor::white), LegendEntry::bars);
  add_if(!map.parking_spaces.empty(), "parking space", kParkingSpaceInk, LegendEntry::frame);
  add_if(!map.road_edges.empty(), "road edge", kRoadEdgeInk, LegendEntry::line);
  add_if(!map.building_lines.empty(), "building line", kBuildingLineInk, LegendEntry::line);
  add_if(!map.signs.empty(), "sign", kSignInk, LegendEntry::sign);
  int32_t phases = 0;
  for (const Junction& junction : map.junctions) phases = std::max(phases, junction.num_phases);
  for (int32_t phase = 0; phase < std::min(phases, 6); ++phase) {
    entries.push_back({fmt::format("light and its line, phase {}", phase), phase_color(phase), LegendEntry::light});
  }
  if (scenario) add_tracks(*scenario, &entries);
  return entries;
}

/// The legend, divided into rows that fit a width.
class Legend {
 public:
  Legend(const RoadMap& map, const Scenario* scenario, const Metrics& m, double width_px) : m_(m) {
    const Canvas measure(1, 1, kPanelColor);
    double x = m.px(24);
    for (const LegendEntry& entry : legend_of(map, scenario)) {
      const double width = m.px(20) + m.px(7) + measure.text_width(entry.label, style());
      if (x + width > width_px - m.px(16) && x > m.px(24)) {
        x = m.px(24);
        ++last_row_;
      }
      placed_.push_back({entry, x, last_row_});
      x += width + m.px(20);
    }
  }

  double height_px() const { return (last_row_ + 1) * m_.px(24); }

  void draw(Canvas& canvas, double first_baseline) const {
    for (const Placed& placed : placed_) {
      const double y = first_baseline + placed.row * m_.px(24), middle = y - m_.px(4.5), sample = m_.px(20);
      draw_sample(canvas, placed.entry, placed.x, middle, sample);
      canvas.text(placed.x + sample + m_.px(7), y, placed.entry.label, style());
    }
  }

 private:
  struct Placed {
    LegendEntry entry;
    double x;
    int row;
  };

  TextStyle style() const { return {.size_px = m_.px(13), .color = kQuietText}; }

  void draw_sample(Canvas& canvas, const LegendEntry& entry, double x, double middle, double width) const {
    const double top = middle - m_.px(6), height = m_.px(12);
    cairo_t* context = canvas.context();
    // Entries for paint have the colour of a road as background.
    if (entry.shape == LegendEntry::line || entry.shape == LegendEntry::bars || entry.shape == LegendEntry::frame) {
      canvas.fill_rectangle(x, top, width, height, lane_color(LaneType::driving));
    }
    switch (entry.shape) {
      case LegendEntry::area: canvas.fill_rectangle(x, top, width, height, entry.color); return;
      case LegendEntry::line: canvas.fill_rectangle(x, middle - m_.px(1.5), width, m_.px(3), entry.color); return;
      case LegendEntry::bars:
        for (int i = 0; i < 3; ++i) canvas.fill_rectangle(x + m_.px(2 + 6 * i), top, m_.px(3), height, entry.color);
        return;
      case LegendEntry::frame:
        canvas.set_color(entry.color);
        cairo_set_line_width(context, m_.px(1.5));
        cairo_rectangle(context, x + m_.px(3), top + m_.px(2), width - m_.px(6), height - m_.px(4));
        cairo_stroke(context);
        return;
      case LegendEntry::light:
        canvas.set_color(entry.color);
        cairo_arc(context, x + 0.5 * width, middle, m_.px(6), 0, kTwoPi);
        cairo_fill(context);
        return;
      case LegendEntry::sign:
        sign_path(context, x + 0.5 * width, middle, m_.px(6));
        canvas.set_color(entry.color);
        cairo_fill(context);
        return;
    }
  }

  Metrics m_;
  int last_row_ = 0;
  std::vector<Placed> placed_;
};

/// Layout of the picture: sizes in pixels, and the map below a band for its name and legend.
struct Layout {
  Metrics m;
  Legend legend;
  double band_px = 0;
  int width_px = 0, height_px = 0;
  double px_per_m = 0;
  Eigen::Vector2d left_top_m{0, 0};  // in the map's coordinates
};

Aabb2 shown_part(const RoadMap& map, const MapPictureOptions& options) {
  const Aabb2 whole = bounds_of(map);
  if (!options.box) return whole;
  constexpr double kMin_m = 1, kMax_m = 1e6;
  const FileBox& box = *options.box;
  const double width_m = box.x1_m - box.x0_m, height_m = box.y1_m - box.y0_m;
  PICTURA_CHECK(width_m >= kMin_m && width_m <= kMax_m && height_m >= kMin_m && height_m <= kMax_m,
                "picture of {}: expected a box of {} to {} m, from its lower left to its upper right corner, got "
                "({}, {}) to ({}, {})",
                map.name, kMin_m, kMax_m, box.x0_m, box.y0_m, box.x1_m, box.y1_m);
  const auto to_map = [&](double x, double y) {
    return Vec2{static_cast<float>(x - map.origin_m[0]), static_cast<float>(y - map.origin_m[1])};
  };
  const Aabb2 shown{to_map(box.x0_m, box.y0_m), to_map(box.x1_m, box.y1_m)};
  PICTURA_CHECK(shown.low.x <= whole.high.x && whole.low.x <= shown.high.x && shown.low.y <= whole.high.y &&
                    whole.low.y <= shown.high.y,
                "picture of {}: the box shows nothing of the map, which lies in ({:.0f}, {:.0f}) to ({:.0f}, {:.0f})",
                map.name, whole.low.x + map.origin_m[0], whole.low.y + map.origin_m[1], whole.high.x + map.origin_m[0],
                whole.high.y + map.origin_m[1]);
  return shown;
}

Layout layout_of(const RoadMap& map, const MapPictureOptions& options) {
  const int size_px = options.size_px;
  PICTURA_CHECK(size_px >= 64 && size_px <= 16384, "picture of {}: expected a size of 64 to 16384 px, got {}", map.name,
                size_px);
  const Aabb2 shown = shown_part(map, options);
  const Metrics m{size_px / 1600.0};
  const double margin = m.px(28), strip = m.px(36);  // the strip below contains the scale bar
  const double width_m = std::max(1.0f, shown.high.x - shown.low.x),
               height_m = std::max(1.0f, shown.high.y - shown.low.y);
  // The longer side of the whole picture, including the band, is size_px. The picture of a narrow map is still wide
  // enough for its title. The band's height and the picture's width depend on each other: a wider picture needs no more
  // rows.
  const auto width_at = [&](double px_per_m) {
    return std::clamp(static_cast<int>(std::ceil(width_m * px_per_m + 2 * margin)), size_px * 3 / 5, size_px);
  };
  const double available = size_px - 2 * margin;
  const auto scale_below = [&](double band) {
    return std::min(available / width_m, (available - band - strip) / height_m);
  };
  Legend legend(map, options.scenario, m, width_at(scale_below(m.px(96))));
  double band = m.px(64) + legend.height_px();
  legend = Legend(map, options.scenario, m, width_at(scale_below(band)));
  band = m.px(64) + legend.height_px();
  const double px_per_m = std::max(scale_below(band), 1e-3);

  Layout layout{m, legend, band};
  layout.px_per_m = px_per_m;
  layout.width_px = width_at(px_per_m);
  layout.height_px =
      std::clamp(static_cast<int>(std::ceil(height_m * px_per_m + 2 * margin + band + strip)), 1, size_px);
  layout.left_top_m = {0.5 * (shown.low.x + shown.high.x) - 0.5 * layout.width_px / px_per_m,
                       shown.high.y + (margin + band) / px_per_m};
  return layout;
}

void draw_scale_bar(Canvas& canvas, const Layout& layout) {
  const Metrics& m = layout.m;
  // Length of the scale bar: the longest round length of at most a fifth of the width.
  const double max_m = 0.2 * canvas.width_px() / layout.px_per_m;
  const double power = std::pow(10.0, std::floor(std::log10(max_m)));
  const double length_m = max_m >= 5 * power ? 5 * power : (max_m >= 2 * power ? 2 * power : power);
  const double width = length_m * layout.px_per_m, height = m.px(6);
  const double x = canvas.width_px() - m.px(24) - width, y = canvas.height_px() - m.px(22);
  canvas.fill_rectangle(x - m.px(10), y - m.px(24), width + m.px(20), m.px(38), kGroundColor, 0.8);
  canvas.fill_rectangle(x, y, width, height, kInk);
  canvas.fill_rectangle(x + 0.25 * width, y + 0.25 * height, 0.25 * width, 0.5 * height, kPanelColor);
  canvas.fill_rectangle(x + 0.75 * width, y + 0.25 * height, 0.25 * width, 0.5 * height, kPanelColor);
  canvas.text(x, y - m.px(7), "0", {.size_px = m.px(14)});
  canvas.text(x + width, y - m.px(7), fmt::format("{:g} m", length_m), {.size_px = m.px(14), .align = Align::right});
}

struct Coordinate {
  double at_m;
  std::string text;
};
std::vector<Coordinate> round_coordinates(double low_m, double high_m) {
  const std::vector<double> ticks = round_ticks(low_m, high_m, 8);
  const int decimals = ticks.size() > 1 ? tick_decimals(ticks[1] - ticks[0]) : 0;
  std::vector<Coordinate> coordinates;
  for (const double at_m : ticks) coordinates.push_back({at_m, fmt::format("{:.{}f}", at_m + 0.0, decimals)});
  return coordinates;
}

/// Draws coordinates of the map's file along the upper and the left side, for the options --box and --at.
void draw_coordinates(Canvas& canvas, const Layout& layout, const RoadMap& map) {
  const Metrics& m = layout.m;
  const double left_m = layout.left_top_m.x() + map.origin_m[0], top_m = layout.left_top_m.y() + map.origin_m[1];
  const TextStyle style{.size_px = m.px(11), .align = Align::center, .color = kQuietText};
  const double corner_px = m.px(40);  // size of the corner where labels of both sides would overlap
  const double right_m = left_m + canvas.width_px() / layout.px_per_m;
  for (const auto& [x_m, text] : round_coordinates(left_m, right_m)) {
    const double x = (x_m - left_m) * layout.px_per_m;
    if (x < corner_px || x > canvas.width_px() - corner_px) continue;
    canvas.fill_rectangle(x, layout.band_px, 1, m.px(5), kQuietText);
    canvas.text(x, layout.band_px + m.px(16), text, style);
  }
  const double lowest_m = top_m - canvas.height_px() / layout.px_per_m;
  for (const auto& [y_m, text] : round_coordinates(lowest_m, top_m)) {
    const double y = (top_m - y_m) * layout.px_per_m;
    if (y < layout.band_px + corner_px || y > canvas.height_px() - corner_px) continue;
    canvas.fill_rectangle(0, y, m.px(5), 1, kQuietText);
    canvas.text(m.px(16), y, text, style, 0.5 * static_cast<double>(kPi));
  }
}

void draw_band(Canvas& canvas, const Layout& layout, const RoadMap& map) {
  const Metrics& m = layout.m;
  canvas.fill_rectangle(0, 0, canvas.width_px(), layout.band_px, kPanelColor);
  canvas.fill_rectangle(0, layout.band_px, canvas.width_px(), m.px(1), kPanelLine);
  const double after_name = m.px(24) + canvas.text(m.px(24), m.px(40), map.name, {.size_px = m.px(28), .bold = true});
  const MapFacts& facts = map.facts;
  canvas.text(
      after_name + m.px(20), m.px(40),
      fmt::format("{} roads   {} junctions ({} with lights)   {} driving lanes, {:.1f} km   {} lights   {} signs   {} "
                  "crosswalks   {} parking spaces",
                  facts.roads, facts.junctions, facts.signal_junctions, facts.driving_lanes, facts.driving_lane_km,
                  facts.traffic_lights, facts.signs, facts.crosswalks, facts.parking_spaces),
      {.size_px = m.px(15), .color = kQuietText});
  layout.legend.draw(canvas, m.px(76));
}

void draw_on(Canvas& canvas, const Layout& layout, const RoadMap& map, const Scenario* scenario) {
  canvas.stop_when_interrupted(fmt::format("map {}: interrupted while it was drawn", map.name));
  MapLayers(map).paint(canvas, layout.left_top_m, layout.px_per_m);
  paint_details(map, canvas, layout.left_top_m, layout.px_per_m);
  if (scenario) {
    paint_paths(*scenario, canvas, layout.left_top_m, layout.px_per_m);
    paint_boxes(*scenario, scenario->current_step, canvas, layout.left_top_m, layout.px_per_m);
  }
  draw_band(canvas, layout, map);
  draw_coordinates(canvas, layout, map);
  draw_scale_bar(canvas, layout);
}

}  // namespace

RgbImage draw_map(const RoadMap& map, const MapPictureOptions& options) {
  const Layout layout = layout_of(map, options);
  Canvas canvas(layout.width_px, layout.height_px, kGroundColor);
  draw_on(canvas, layout, map, options.scenario);
  return canvas.image();
}

void draw_map_png(const RoadMap& map, const std::string& path, const MapPictureOptions& options) {
  const InterruptibleWork work(fmt::format("{}: interrupted while it was drawn", path));
  const RgbImage image = draw_map(map, options);
  work.check();
  write_png(path, image.width_px, image.height_px, image.rgb);
}

void draw_map_svg(const RoadMap& map, const std::string& path, const MapPictureOptions& options) {
  const Layout layout = layout_of(map, options);
  Canvas canvas(path, layout.width_px, layout.height_px, kGroundColor);
  draw_on(canvas, layout, map, options.scenario);
  write_file(path, canvas.svg());
}

}  // namespace pictura
