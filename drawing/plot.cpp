#include "pictura/drawing/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/drawing/canvas.h"

namespace pictura {

Rgb series_color(size_t series) {
  constexpr std::array<Rgb, 7> kColors{hex(0x1F6FEB), hex(0xE8590C), hex(0x2B8A3E), hex(0x9C36B5),
                                       hex(0xC92A2A), hex(0x0B7285), hex(0x846358)};
  return kColors[series % kColors.size()];
}

namespace {

constexpr Rgb kAxisColor = hex(0x3A3F46), kGridColor = hex(0xE3E5E8), kLabelColor = hex(0x5A6068);
constexpr double kBandAlpha = 0.18;
constexpr double kLeft_px = 74, kRight_px = 18, kTop_px = 40, kBottom_px = 50;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// Padded by a share of its size, or by single_padding around what is a single value but for rounding; never empty.
  Range padded(double share, double single_padding) const {
    if (!(low <= high)) return {0, 1};
    const bool is_single = high - low <= 1e-12 * std::max(std::abs(low), std::abs(high));
    const double padding = is_single ? single_padding : share * (high - low);
    return {low - padding, high + padding};
  }
};

/// "1.5M", "20k", "0.02": as many decimals as the step between ticks needs.
std::string tick_text(double value, double step) {
  const double magnitude = std::max(std::abs(value), step);
  double unit = 1;
  const char* suffix = "";
  if (magnitude >= 1e9) {
    unit = 1e9, suffix = "G";
  } else if (magnitude >= 1e6) {
    unit = 1e6, suffix = "M";
  } else if (magnitude >= 1e4) {
    unit = 1e3, suffix = "k";
  }
  if (std::abs(value) < 1e-9 * step) return "0";
  if (magnitude < 1e-4) return fmt::format("{:.2g}", value);
  return fmt::format("{:.{}f}{}", value / unit, tick_decimals(step / unit), suffix);
}

/// "2M", "50k", "16384", "0.25": a tick of a logarithmic axis, exactly.
std::string tick_text(double value) {
  if (value >= 1e6) return fmt::format("{:g}M", value / 1e6);
  const bool is_of_thousands = value >= 1e4 && std::fmod(value, 1e3) == 0;
  return is_of_thousands ? fmt::format("{:g}k", value / 1e3) : fmt::format("{:g}", value);
}

/// From values to pixels.
class Axis {
 public:
  struct Tick {
    double value;
    std::string text;
  };
  explicit Axis(AxisScale scale) : scale_(scale) {}
  bool shows(double value) const { return std::isfinite(value) && (scale_ == AxisScale::linear || value > 0); }
  void add(double value) { range_.add(scaled(value)); }
  /// Maps the range of the added values, padded by a share of it, to [low_px, high_px].
  void set_pixels(double padding, double low_px, double high_px) {
    range_ = range_.padded(padding, scale_ == AxisScale::linear ? std::max(0.5 * std::abs(range_.low), 0.5) : 1.0);
    low_px_ = low_px;
    high_px_ = high_px;
  }
  double at_px(double value) const {
    return low_px_ + (high_px_ - low_px_) * (scaled(value) - range_.low) / (range_.high - range_.low);
  }
  std::vector<Tick> ticks(int wanted) const {
    std::vector<Tick> ticks;
    if (scale_ == AxisScale::linear) {
      const std::vector<double> values = round_ticks(range_.low, range_.high, wanted);
      const double step = values.size() > 1 ? values[1] - values[0] : 1.0;
      for (const double value : values) ticks.push_back({value, tick_text(value, step)});
      return ticks;
    }
    const double low = std::exp2(range_.low), high = std::exp2(range_.high);
    const auto values =
        scale_ == AxisScale::binary ? binary_ticks(low, high, wanted) : decimal_ticks(low, high, wanted);
    for (const double value : values) ticks.push_back({value, tick_text(value)});
    return ticks;
  }

 private:
  double scaled(double value) const { return scale_ == AxisScale::linear ? value : std::log2(value); }

  AxisScale scale_;
  Range range_;
  double low_px_ = 0, high_px_ = 1;
};

struct Point {
  double x, y;
};
/// The corner of the plot in which a box of that size covers the fewest points.
Point emptiest_corner(const std::vector<Point>& points, Point top_left, double width, double height, double box_width,
                      double box_height) {
  constexpr double kPadding_px = 8;
  const double left = top_left.x + kPadding_px, right = top_left.x + width - box_width - kPadding_px;
  const double top = top_left.y + kPadding_px, bottom = top_left.y + height - box_height - kPadding_px;
  Point best{right, top};
  long fewest = std::numeric_limits<long>::max();
  for (const Point corner : {Point{right, top}, Point{left, top}, Point{right, bottom}, Point{left, bottom}}) {
    const long covered = std::count_if(points.begin(), points.end(), [&](const Point& p) {
      return p.x >= corner.x && p.x <= corner.x + box_width && p.y >= corner.y && p.y <= corner.y + box_height;
    });
    if (covered < fewest) {
      fewest = covered;
      best = corner;
    }
  }
  return best;
}

/// Adds points along the line from the last one to another.
void add_line(std::vector<Point>* points_inout, Point to) {
  constexpr double kStep_px = 4;
  const Point from = points_inout->back();
  const int steps = 1 + static_cast<int>(std::hypot(to.x - from.x, to.y - from.y) / kStep_px);
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    points_inout->push_back({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)});
  }
}

void set_dashes(cairo_t* context, const PlotSeries& series) {
  constexpr double kDashes_px[] = {7, 6};
  cairo_set_dash(context, kDashes_px, series.dashed ? std::size(kDashes_px) : 0, 0);
}

/// What a legend shows of a series: a piece of its line from (x, y) to the right.
void draw_sample(Canvas& canvas, const PlotSeries& series, Rgb color, double x, double y, double width_px) {
  cairo_t* context = canvas.context();
  canvas.set_color(color);
  cairo_set_line_width(context, 2.5);
  set_dashes(context, series);
  cairo_move_to(context, x, y);
  cairo_line_to(context, x + width_px, y);
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
}

/// `points`: along all lines of the panel, in pixels.
void draw_legend(Canvas& canvas, const PlotPanel& panel, const std::vector<Point>& points, Point top_left, double width,
                 double height) {
  const TextStyle style{.size_px = 12, .color = hex(0x22262B)};
  double widest = 0;
  for (const PlotSeries& series : panel.series) widest = std::max(widest, canvas.text_width(series.name, style));
  constexpr double kRow_px = 18;
  const double box_width = widest + 44, box_height = kRow_px * static_cast<double>(panel.series.size()) + 8;
  const auto [x, y] = emptiest_corner(points, top_left, width, height, box_width, box_height);
  canvas.round_rectangle_path(x, y, box_width, box_height, 4);
  canvas.set_color(hex(0xFFFFFF), 0.85);
  cairo_fill_preserve(canvas.context());
  canvas.set_color(kGridColor);
  cairo_set_line_width(canvas.context(), 1);
  cairo_stroke(canvas.context());
  for (size_t i = 0; i < panel.series.size(); ++i) {
    const double middle = y + 4 + kRow_px * (static_cast<double>(i) + 0.5);
    draw_sample(canvas, panel.series[i], series_color(i), x + 8, middle, 20);
    canvas.text(x + 36, middle + 4, panel.series[i].name, style);
  }
}

constexpr double kNameRow_px = 22, kNameLine_px = 24;

/// Where the names of series go, from the picture's corner, in rows as wide as it.
std::vector<Point> lay_out_names(const Canvas& canvas, const std::vector<PlotSeries>& all, const TextStyle& style,
                                 double width_px) {
  constexpr double kMargin_px = kLeft_px + 6, kGap_px = 28;
  std::vector<Point> places;
  Point at{kMargin_px, 0};
  for (const PlotSeries& series : all) {
    const double entry_px = kNameLine_px + 8 + canvas.text_width(series.name, style);
    if (at.x > kMargin_px && at.x + entry_px > width_px - kRight_px) at = {kMargin_px, at.y + kNameRow_px};
    places.push_back(at);
    at.x += entry_px + kGap_px;
  }
  return places;
}

void draw_names(Canvas& canvas, const std::vector<PlotSeries>& all, const std::vector<Point>& places,
                const TextStyle& style, double top) {
  for (size_t s = 0; s < all.size(); ++s) {
    const Rgb color = series_color(s);
    const double x = places[s].x, middle = top + places[s].y + 0.5 * kNameRow_px;
    if (!all[s].low.empty()) canvas.fill_rectangle(x, middle - 6, kNameLine_px, 12, color, kBandAlpha);
    draw_sample(canvas, all[s], color, x, middle, kNameLine_px);
    canvas.text(x + kNameLine_px + 8, middle + 4.5, all[s].name, style);
  }
}

void draw_strip(Canvas& canvas, const std::vector<PlotCell>& strip, const Axis& x_axis, double top) {
  constexpr double kStrip_px = 6;
  for (size_t i = 0; i < strip.size(); ++i) {
    const double at = x_axis.at_px(strip[i].x);
    const double begin = i == 0 ? at : 0.5 * (at + x_axis.at_px(strip[i - 1].x));
    const double end = i + 1 == strip.size() ? at : 0.5 * (at + x_axis.at_px(strip[i + 1].x));
    canvas.fill_rectangle(begin, top, end - begin, kStrip_px, strip[i].color);
  }
}

void draw_marks(Canvas& canvas, const std::vector<PlotMark>& marks, const Axis& x_axis, double top, double height) {
  cairo_t* context = canvas.context();
  const double dashes[] = {4, 4};
  for (const PlotMark& mark : marks) {
    const double x = std::round(x_axis.at_px(mark.x)) + 0.5;  // a whole pixel
    canvas.set_color(kLabelColor);
    cairo_set_dash(context, dashes, 2, 0);
    cairo_set_line_width(context, 1);
    cairo_move_to(context, x, top);
    cairo_line_to(context, x, top + height);
    cairo_stroke(context);
    cairo_set_dash(context, nullptr, 0, 0);
    canvas.text(x, top - 3, mark.label, {.size_px = 11.5, .align = Align::center, .color = kAxisColor});
  }
}

/// Fills what lies between the band's bounds, from gap to gap.
void fill_band(Canvas& canvas, const PlotSeries& series, const Axis& x_axis, const Axis& y_axis, Rgb color) {
  cairo_t* context = canvas.context();
  const auto drawable = [&](size_t i) {
    return x_axis.shows(series.x[i]) && y_axis.shows(series.low[i]) && y_axis.shows(series.high[i]);
  };
  canvas.set_color(color, kBandAlpha);
  for (size_t begin = 0, end = 0; begin < series.low.size(); begin = end + 1) {
    for (end = begin; end < series.low.size() && drawable(end);) ++end;
    for (size_t i = begin; i < end; ++i)
      cairo_line_to(context, x_axis.at_px(series.x[i]), y_axis.at_px(series.high[i]));
    for (size_t i = end; i-- > begin;) cairo_line_to(context, x_axis.at_px(series.x[i]), y_axis.at_px(series.low[i]));
    cairo_fill(context);
  }
}

bool is_drawable(const PlotSeries& series, size_t i, const Axis& x_axis, const Axis& y_axis) {
  return x_axis.shows(series.x[i]) && y_axis.shows(series.y[i]);
}

/// What the axes show of the series and their bands.
void add_values(const std::vector<PlotSeries>& all, Axis* x_axis, Axis* y_axis) {
  for (const PlotSeries& series : all) {
    for (size_t i = 0; i < series.x.size(); ++i) {
      if (!is_drawable(series, i, *x_axis, *y_axis)) continue;
      x_axis->add(series.x[i]);
      y_axis->add(series.y[i]);
    }
    for (const std::vector<double>* bound : {&series.low, &series.high}) {
      for (const double y : *bound) {
        if (y_axis->shows(y)) y_axis->add(y);
      }
    }
  }
}

/// The lines and numbers of both axes' ticks, and the axes themselves.
void draw_axes(Canvas& canvas, const Axis& x_axis, const Axis& y_axis, double left, double top, double width,
               double height) {
  const TextStyle x_style{.size_px = 11.5, .align = Align::center, .color = kLabelColor};
  const TextStyle y_style{.size_px = 11.5, .align = Align::right, .color = kLabelColor};
  for (const Axis::Tick& tick : x_axis.ticks(std::max(2, static_cast<int>(width / 80)))) {
    const double x = x_axis.at_px(tick.value);
    canvas.fill_rectangle(std::round(x), top, 1, height, kGridColor);
    canvas.text(x, top + height + 17, tick.text, x_style);
  }
  for (const Axis::Tick& tick : y_axis.ticks(std::max(2, static_cast<int>(height / 45)))) {
    const double y = y_axis.at_px(tick.value);
    canvas.fill_rectangle(left, std::round(y), width, 1, kGridColor);
    canvas.text(left - 8, y + 4, tick.text, y_style);
  }
  canvas.fill_rectangle(left - 1, top, 1, height + 1, kAxisColor);
  canvas.fill_rectangle(left - 1, top + height, width + 1, 1, kAxisColor);
}

/// A line from gap to gap, and a dot where a point stands alone. Adds where it runs to `along`.
void draw_line(Canvas& canvas, const PlotSeries& series, const Axis& x_axis, const Axis& y_axis, Rgb color,
               std::vector<Point>* along) {
  cairo_t* context = canvas.context();
  const auto drawable = [&](size_t i) { return is_drawable(series, i, x_axis, y_axis); };
  canvas.set_color(color);
  set_dashes(context, series);
  for (size_t i = 0; i < series.x.size(); ++i) {
    if (!drawable(i)) {
      cairo_stroke(context);
      continue;
    }
    const Point at{x_axis.at_px(series.x[i]), y_axis.at_px(series.y[i])};
    const bool starts = i == 0 || !drawable(i - 1);
    const bool alone = starts && (i + 1 == series.x.size() || !drawable(i + 1));
    if (starts) {
      cairo_move_to(context, at.x, at.y);
      along->push_back(at);
    } else {
      add_line(along, at);
    }
    cairo_line_to(context, at.x, at.y);
    if (alone) {
      cairo_stroke(context);
      cairo_arc(context, at.x, at.y, 3, 0, kTwoPi);
      cairo_fill(context);
    }
  }
  cairo_stroke(context);
}

void draw_panel(Canvas& canvas, const PlotPanel& panel, double x0, double y0, double width_px, double height_px,
                bool with_legend) {
  Axis x_axis(panel.x_scale), y_axis(panel.y_scale);
  add_values(panel.series, &x_axis, &y_axis);
  const double left = x0 + kLeft_px, top = y0 + kTop_px;
  const double width = width_px - kLeft_px - kRight_px, height = height_px - kTop_px - kBottom_px;
  x_axis.set_pixels(0.0, left, left + width);
  y_axis.set_pixels(0.06, top + height, top);

  canvas.text(x0 + 0.5 * (kLeft_px + width_px - kRight_px), y0 + 24, panel.title,
              {.size_px = 15, .bold = true, .align = Align::center});
  draw_axes(canvas, x_axis, y_axis, left, top, width, height);
  draw_strip(canvas, panel.strip, x_axis, top + height + 1);
  draw_marks(canvas, panel.marks, x_axis, top, height);
  const TextStyle label_style{.size_px = 12.5, .align = Align::center, .color = kAxisColor};
  canvas.text(left + 0.5 * width, y0 + height_px - 12, panel.x_label, label_style);
  canvas.text(x0 + 17, top + 0.5 * height, panel.y_label, label_style, 0.5 * static_cast<double>(kPi));

  cairo_t* context = canvas.context();
  cairo_save(context);
  cairo_rectangle(context, left - 1, top - 2, width + 3, height + 4);
  cairo_clip(context);
  cairo_set_line_width(context, 2);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_ROUND);
  for (size_t s = 0; s < panel.series.size(); ++s) {
    fill_band(canvas, panel.series[s], x_axis, y_axis, series_color(s));
  }
  std::vector<Point> along;
  for (size_t s = 0; s < panel.series.size(); ++s) {
    draw_line(canvas, panel.series[s], x_axis, y_axis, series_color(s), &along);
  }
  cairo_restore(context);
  if (with_legend) draw_legend(canvas, panel, along, {left, top}, width, height);
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(high > low) || wanted < 1 || !std::isfinite(high - low)) return ticks;
  const double raw = (high - low) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double ratio = raw / power;
  const double step = power * (ratio < 1.5 ? 1 : (ratio < 3.5 ? 2 : (ratio < 7.5 ? 5 : 10)));
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  // Counted, since adding one to a number as large as `first` may be changes nothing.
  const auto count = static_cast<int>(std::min(last - first + 1, 4.0 * wanted));
  for (int i = 0; i < count; ++i) ticks.push_back((first + i) * step);
  return ticks;
}

int tick_decimals(double step) { return std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6); }

std::vector<double> binary_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(low > 0 && high >= low) || wanted < 1 || !std::isfinite(high)) return ticks;
  const double first = std::ceil(std::log2(low) - 1e-9), last = std::floor(std::log2(high) + 1e-9);
  const double step = std::max(1.0, std::ceil((last - first + 1) / wanted));
  for (double power = first; power <= last; power += step) ticks.push_back(std::exp2(power));
  return ticks.size() > 1 ? ticks : round_ticks(low, high, wanted);
}

std::vector<double> decimal_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(low > 0 && high >= low) || wanted < 1 || !std::isfinite(high)) return ticks;
  const double first = std::floor(std::log10(low)), last = std::floor(std::log10(high) + 1e-9);
  auto list = [&](std::initializer_list<int> factors, double step) {
    ticks.clear();
    for (double power = first; power <= last; power += step) {
      for (const int factor : factors) {
        const double tick = factor * std::pow(10.0, power);
        if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push_back(tick);
      }
    }
    return ticks.size() <= static_cast<std::size_t>(wanted);
  };
  if (list({1, 2, 5}, 1)) return ticks.size() > 1 ? ticks : round_ticks(low, high, wanted);
  for (double step = 1; !list({1}, step); ++step) continue;
  return ticks;
}

RgbImage draw_plots(const std::vector<PlotPanel>& panels, const PlotOptions& options) {
  PICTURA_CHECK(!panels.empty(), "plot '{}': expected at least one panel", options.title);
  PICTURA_CHECK(options.panel_width_px >= 160 && options.panel_width_px <= 8192 && options.panel_height_px >= 140 &&
                    options.panel_height_px <= 8192 && options.columns >= 1,
                "plot '{}': expected panels of 160x140 to 8192x8192 px and 1 column or more, got {}x{} and {}",
                options.title, options.panel_width_px, options.panel_height_px, options.columns);
  for (const PlotPanel& panel : panels) {
    for (const PlotSeries& series : panel.series) {
      PICTURA_CHECK(series.x.size() == series.y.size(),
                    "plot '{}', series '{}': expected equally many x and y, got {} and {}", panel.title, series.name,
                    series.x.size(), series.y.size());
      PICTURA_CHECK(
          series.low.size() == series.high.size() && (series.low.empty() || series.low.size() == series.x.size()),
          "plot '{}', series '{}': expected a band of {} points or none, got {} and {}", panel.title, series.name,
          series.x.size(), series.low.size(), series.high.size());
    }
  }
  const int num_panels = static_cast<int>(panels.size());
  const int columns = std::min(options.columns, num_panels), rows = (num_panels + columns - 1) / columns;
  const int width_px = columns * options.panel_width_px + 12, title_px = options.title.empty() ? 6 : 44;
  int top = title_px;
  const TextStyle name_style{.size_px = 13};
  std::vector<Point> names;
  if (options.one_legend && !panels[0].series.empty()) {
    names = lay_out_names(Canvas(1, 1, hex(0xFFFFFF)), panels[0].series, name_style, width_px);
    top += static_cast<int>(names.back().y + kNameRow_px);
  }
  Canvas canvas(width_px, top + rows * options.panel_height_px + 6, hex(0xFFFFFF));
  if (!names.empty()) draw_names(canvas, panels[0].series, names, name_style, title_px);
  if (!options.title.empty()) {
    canvas.text(0.5 * canvas.width_px(), 31, options.title, {.size_px = 19, .bold = true, .align = Align::center});
  }
  for (int i = 0; i < num_panels; ++i) {
    const PlotPanel& panel = panels[static_cast<size_t>(i)];
    draw_panel(canvas, panel, 6 + i % columns * options.panel_width_px, top + i / columns * options.panel_height_px,
               options.panel_width_px, options.panel_height_px, !options.one_legend && panel.series.size() > 1);
  }
  return canvas.image();
}

void draw_plots_png(const std::vector<PlotPanel>& panels, const std::string& path, const PlotOptions& options) {
  const RgbImage image = draw_plots(panels, options);
  write_png(path, image.width_px, image.height_px, image.rgb);
}

}  // namespace pictura
