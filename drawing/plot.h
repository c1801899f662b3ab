// Line plots for people: several panels in one picture, several series in each.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/image.h"

namespace pictura {

/// Linear, or logarithmic with ticks at powers of 2, or at 1, 2 and 5 times powers of 10.
enum class AxisScale { linear, binary, decimal };

/// One line; points that are not finite, or not above 0 on a logarithmic axis, leave a gap.
struct PlotSeries {
  std::string name;
  std::vector<double> x, y;       // of equal length
  std::vector<double> low, high;  // of a band behind the line: as long, or empty where there is none
  bool dashed = false;
};

/// A place of the x axis.
struct PlotMark {
  double x = 0;
  std::string label;
};
/// A cell of the strip under the x axis; it reaches half way to its neighbours.
struct PlotCell {
  double x = 0;
  Rgb color;
};

struct PlotPanel {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series;
  AxisScale x_scale = AxisScale::linear, y_scale = AxisScale::linear;
  std::vector<PlotMark> marks{};  // dashed lines across the plot, labelled above it
  std::vector<PlotCell> strip{};  // in ascending order, or empty
};

/// The colour of a panel's series of this index.
Rgb series_color(size_t series);

struct PlotOptions {
  int panel_width_px = 560, panel_height_px = 360;
  int columns = 2;
  std::string title;
  bool one_legend = false;  // of the first panel's series, above all panels, instead of one in each panel
};

/// Panels in rows of options.columns, with axes, ticks at round numbers, a grid and a legend if there is more than one
/// series, or above them. Throws Error if there is no panel, a series' lists are of unequal length, or a panel is not
/// of 160x140 to 8192x8192 px.
RgbImage draw_plots(const std::vector<PlotPanel>& panels, const PlotOptions& options = {});

/// draw_plots() as a PNG file. Throws Error naming the path.
void draw_plots_png(const std::vector<PlotPanel>& panels, const std::string& path, const PlotOptions& options = {});

/// Round positions for axis ticks: a step of 1, 2 or 5 times a power of ten, about `wanted` of them within [low, high].
std::vector<double> round_ticks(double low, double high, int wanted);
/// As many decimals as tell ticks apart that are `step` from each other, at most six.
int tick_decimals(double step);

/// ... of a logarithmic axis, 0 < low: at most `wanted`, evenly spaced powers of two; or 1, 2 and 5 times powers of
/// ten, or only powers of ten if those are too many. If only one would remain, the ticks of a linear axis.
std::vector<double> binary_ticks(double low, double high, int wanted);
std::vector<double> decimal_ticks(double low, double high, int wanted);

}  // namespace pictura
