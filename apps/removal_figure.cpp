#include "pictura/apps/removal_figure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pictura/drawing/plot.h"

namespace pictura {

namespace {

struct RemovalQuantity {
  const char *title, *label;
  Estimate RemovalRow::* estimate;
};
constexpr RemovalQuantity kRemovalQuantities[] = {
    {"Value", "mean |dV|", &RemovalRow::abs_value_change},
    {"Braking probability", "mean |dP(brake)|", &RemovalRow::abs_brake_change}};

void add_point(PlotSeries* series, double x, const Estimate& estimate) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const bool is_known = std::isfinite(estimate.value), has_band = is_known && std::isfinite(estimate.half_width_95);
  series->x.push_back(x);
  series->y.push_back(is_known ? estimate.value : nothing);
  // No mean of magnitudes is below 0.
  series->low.push_back(has_band ? std::max(0.0, estimate.value - estimate.half_width_95) : nothing);
  series->high.push_back(has_band ? estimate.value + estimate.half_width_95 : nothing);
}

}  // namespace

void draw_removal_figure(const RemovalResults& results, const std::vector<RemovalRow>& rows, const std::string& path) {
  std::vector<PlotPanel> panels;
  for (const bool by_distance : {false, true}) {
    for (const RemovalQuantity& quantity : kRemovalQuantities) {
      PlotPanel panel{.title = fmt::format("{}{}", quantity.title, by_distance ? ", wholly hidden users" : ""),
                      .x_label = by_distance ? "distance of the user (m)" : "occlusion of the user (%)",
                      .y_label = quantity.label};
      for (const ProbedPolicy& policy : results.policies) panel.series.push_back({.name = policy.answers_as()});
      for (const RemovalRow& row : rows) {
        PlotSeries* const series = &panel.series[static_cast<size_t>(row.policy)];
        const RemovalGroup& group = row.group;
        const Estimate& estimate = row.*quantity.estimate;
        if (by_distance && group.distance_band && group.occlusion_bin == RemovalGroup::kOcclusionBins) {
          add_point(series, static_cast<double>(kDistanceBand_m) * (*group.distance_band + 0.5), estimate);
        } else if (!by_distance && !group.distance_band && group.occlusion_bin >= 0 && row.cases > 0) {
          add_point(series, 100 * row.mean_occlusion, estimate);
        }
      }
      panels.push_back(std::move(panel));
    }
  }
  draw_plots_png(panels, path, {.panel_width_px = 520, .panel_height_px = 330, .columns = 2, .one_legend = true});
}

}  // namespace pictura
